// Files of meshes: which are there, which may come, which go. Their pieces are played.
#include "control_plane/cluster/visuals.h"

#include <gmock/gmock.h>

#include <optional>
#include <set>

#include "control_plane/testing/state_rig.h"
#include "core/world/limits.h"

namespace tessera::control {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using namespace std::chrono_literals;

const std::string kQuay(64, 'a'), kShip(64, 'b');

class VisualsTest : public ::testing::Test {
 protected:
  static constexpr std::uint64_t kQuota = 1000;

  void Put(const std::string& sha256, std::uint64_t size) {
    ASSERT_TRUE(visuals_->CheckPut(sha256, size).ok());
    ASSERT_TRUE(visuals_->Begin(sha256, size).ok());
    ASSERT_TRUE(visuals_->Finish(sha256).ok());
  }
  // Sweeps, and gives the files that are removed by it.
  std::set<std::string> Swept(std::chrono::milliseconds later) {
    rig_.Pass(later);
    rig_.state->effects().visuals.clear();
    visuals_->Sweep(rig_.now);
    return rig_.state->effects().visuals;
  }
  void Reload(std::uint64_t quota = kQuota) {
    visuals_.emplace(*rig_.state, quota, 15min);
    ASSERT_TRUE(visuals_->Load().ok());
  }
  InstanceEntry& DrawnWith(const std::string& sha256) {
    HostEntry& host = rig_.AddHost("alpha");
    InstanceEntry& instance = rig_.AddRunning({&host});
    records::Instance next = instance.record;
    next.add_visuals(sha256);
    EXPECT_TRUE(rig_.state->StoreInstance(instance, next).ok());
    return instance;
  }

  StateRig rig_;
  std::optional<Visuals> visuals_{std::in_place, *rig_.state, kQuota, 15min};
};

TEST_F(VisualsTest, AFileIsThereOnceItIsWhole) {
  ASSERT_TRUE(visuals_->Begin(kQuay, 10).ok());
  EXPECT_EQ(visuals_->SizeOf(kQuay), 0u);
  v1::FindMissingVisualsRequest request;
  request.add_sha256(kShip);
  request.add_sha256(kQuay);
  EXPECT_THAT(visuals_->FindMissing(request)->sha256(), ElementsAre(kShip, kQuay));
  ASSERT_TRUE(visuals_->Finish(kQuay).ok());
  EXPECT_EQ(visuals_->SizeOf(kQuay), 10u);
  EXPECT_THAT(visuals_->FindMissing(request)->sha256(), ElementsAre(kShip));
  EXPECT_EQ(visuals_->CheckPut(kQuay, 10).code(), absl::StatusCode::kAlreadyExists);
  Reload();
  EXPECT_EQ(visuals_->SizeOf(kQuay), 10u) << "another life finds it";
}

TEST_F(VisualsTest, WhatWasCutIsNotThereAndGoes) {
  ASSERT_TRUE(visuals_->Begin(kQuay, 10).ok());
  EXPECT_EQ(visuals_->LeftOver(kQuay), 0u) << "somebody writes it";
  EXPECT_THAT(Swept(1h), IsEmpty());
  Reload();
  EXPECT_EQ(visuals_->SizeOf(kQuay), 0u) << "a control plane that died while it came has not all of it";
  EXPECT_EQ(visuals_->LeftOver(kQuay), 10u);
  EXPECT_THAT(Swept(1s), ElementsAre(kQuay));
  ASSERT_TRUE(visuals_->Remove(kQuay).ok());
  EXPECT_EQ(visuals_->bytes(), 0u);
  EXPECT_THAT(*rig_.store.List("visual"), IsEmpty());
}

TEST_F(VisualsTest, AStoreThatFailsKeepsNothingHalf) {
  rig_.store.FailNext(1);
  EXPECT_EQ(visuals_->Begin(kQuay, 10).code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(visuals_->bytes(), 0u);
  ASSERT_TRUE(visuals_->Begin(kQuay, 10).ok());
  rig_.store.FailNext(1);
  EXPECT_EQ(visuals_->Finish(kQuay).code(), absl::StatusCode::kUnavailable);
  visuals_->Abandon(kQuay);
  EXPECT_EQ(visuals_->SizeOf(kQuay), 0u);
  EXPECT_THAT(Swept(1s), ElementsAre(kQuay));
}

TEST_F(VisualsTest, TheQuotaHolds) {
  Put(kQuay, 600);
  const absl::Status full = visuals_->CheckPut(kShip, 401);
  EXPECT_EQ(full.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(full.message()), HasSubstr("size: 401 bytes are more than the 400 of 1000 that "
                                                     "--visual-quota-mb leaves"));
  Put(kShip, 400);
  EXPECT_EQ(visuals_->bytes(), 1000u);
}

TEST_F(VisualsTest, ABadNameOrSizeIsRefused) {
  for (const std::string& name : {std::string(), std::string(63, 'a'), std::string(64, 'A'), std::string("../x")}) {
    EXPECT_THAT(std::string(visuals_->CheckPut(name, 1).message()), HasSubstr("sha256: \"")) << name;
  }
  EXPECT_THAT(std::string(visuals_->CheckPut(kQuay, 0).message()), HasSubstr("size: 0 is not in 1 to 67108864"));
  EXPECT_EQ(visuals_->CheckPut(kQuay, kMaxVisualFile_bytes + 1).code(), absl::StatusCode::kInvalidArgument);
  v1::FindMissingVisualsRequest request;
  for (int i = 0; i < 257; ++i) request.add_sha256(kQuay);
  EXPECT_EQ(visuals_->FindMissing(request).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST_F(VisualsTest, AWorldKeepsItsFileAndAWhileAfterIt) {
  InstanceEntry& instance = DrawnWith(kQuay);
  Put(kQuay, 10);
  Put(kShip, 20);
  EXPECT_THAT(Swept(1s), IsEmpty());
  EXPECT_THAT(Swept(14min), IsEmpty());
  EXPECT_THAT(Swept(1min), ElementsAre(kShip)) << "nobody made a world of it";
  EXPECT_EQ(visuals_->SizeOf(kShip), 0u);
  ASSERT_TRUE(visuals_->Remove(kShip).ok());
  records::Instance next = instance.record;
  next.set_state(v1::INSTANCE_STATE_FAILED);
  ASSERT_TRUE(rig_.state->StoreInstance(instance, next).ok());
  EXPECT_THAT(Swept(24h), IsEmpty()) << "it may be restored";
  next.set_state(v1::INSTANCE_STATE_ENDED);
  ASSERT_TRUE(rig_.state->StoreInstance(instance, next).ok());
  EXPECT_THAT(Swept(1s), IsEmpty()) << "the level may be tried again";
  EXPECT_THAT(Swept(15min), ElementsAre(kQuay));
  EXPECT_THAT(Swept(1s), ElementsAre(kQuay)) << "until it is removed";
}

TEST_F(VisualsTest, WhoeverAsksForAFileMayRelyOnItForAWhile) {
  Put(kQuay, 10);
  EXPECT_THAT(Swept(1s), IsEmpty());
  EXPECT_THAT(Swept(14min), IsEmpty());
  v1::FindMissingVisualsRequest request;
  request.add_sha256(kQuay);
  EXPECT_THAT(visuals_->FindMissing(request)->sha256(), IsEmpty());
  EXPECT_THAT(Swept(14min), IsEmpty());
  EXPECT_EQ(visuals_->CheckPut(kQuay, 10).code(), absl::StatusCode::kAlreadyExists);
  EXPECT_THAT(Swept(14min), IsEmpty());
  EXPECT_THAT(Swept(15min), ElementsAre(kQuay));
}

TEST_F(VisualsTest, ASceneWhoseFileIsMissingIsNamedWithWhatHelps) {
  Put(kQuay, 10);
  EXPECT_TRUE(visuals_->CheckThere({kQuay}).ok());
  const absl::Status missing = visuals_->CheckThere({kQuay, kShip});
  EXPECT_EQ(missing.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(missing.message()),
              HasSubstr("spec.scene: is drawn with " + kShip + ".glb, which is not here"));
  EXPECT_THAT(std::string(missing.message()), HasSubstr("`tessera instance create` sends it"));
  EXPECT_THAT(std::string(visuals_->CheckThere({kShip, std::string(64, 'c')}).message()), HasSubstr("and 1 more"));
}

TEST_F(VisualsTest, WithoutAQuotaNoneIsTakenAndNoneIsMissed) {
  Reload(0);
  v1::FindMissingVisualsRequest request;
  request.add_sha256(kQuay);
  const auto found = visuals_->FindMissing(request);
  EXPECT_TRUE(found->keeps_none());
  EXPECT_THAT(found->sha256(), IsEmpty());
  EXPECT_TRUE(visuals_->CheckThere({kQuay}).ok());
  EXPECT_EQ(visuals_->CheckPut(kQuay, 1).code(), absl::StatusCode::kFailedPrecondition);
}

TEST_F(VisualsTest, ARecordThatCannotBeReadIsSetAside) {
  ASSERT_TRUE(rig_.store.Put("visual/feed", "", kAbsent).ok());
  EXPECT_TRUE(visuals_->Load().ok());
  EXPECT_TRUE(rig_.state->IsSetAside("visual/feed"));
  EXPECT_EQ(visuals_->SizeOf("feed"), 0u);
}

}  // namespace
}  // namespace tessera::control
