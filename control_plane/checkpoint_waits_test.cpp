// A control plane whose checkpoints lie on a target that keeps it waiting, or fails.
#include <gmock/gmock.h>

#include <future>
#include <map>
#include <mutex>
#include <thread>

#include "control_plane/bundle.h"
#include "control_plane/checkpoint_files.h"
#include "control_plane/cluster/queries.h"
#include "control_plane/control_plane.h"
#include "control_plane/memory_store.h"
#include "control_plane/stored_records.h"
#include "control_plane/testing/grpc_server_fixture.h"
#include "control_plane/testing/loaded_plane.h"
#include "core/world/partition_io.h"
#include "core/world/partition_map.h"
#include "core/world/scene_io.h"
#include "core/world/sha256.h"
#include "host/temporary_folder.h"
#include "telemetry/testing/captured_log.h"

namespace tessera::control {
namespace {

using ::testing::HasSubstr;

// In memory. Putting waits while it is held up, and fails with `put_fault`; reading fails with `read_fault`.
class HeldTarget final : public CheckpointTarget {
 public:
  const std::string& name() const override { return name_; }
  absl::Status CheckRoom(std::uint64_t /*bytes*/) override { return absl::OkStatus(); }
  absl::Status Put(const std::string& instance, std::uint64_t tick, const std::string& file,
                   const std::string& bytes) override {
    ++puts;
    held.wait(true);
    const std::lock_guard lock(mutex_);
    if (put_fault.ok()) files_[KeyOf(instance, tick, file)] = bytes;
    return put_fault;
  }
  absl::Status Publish(const std::string& instance, std::uint64_t tick, const std::string& manifest) override {
    return Put(instance, tick, kManifestFile, manifest);
  }
  void Abandon(const std::string& /*instance*/, std::uint64_t /*tick*/) override {}
  absl::StatusOr<std::string> Read(const std::string& instance, std::uint64_t tick, const std::string& file) override {
    const std::lock_guard lock(mutex_);
    if (!read_fault.ok()) return read_fault;
    const auto found = files_.find(KeyOf(instance, tick, file));
    if (found == files_.end()) return absl::NotFoundError("is not there");
    return found->second;
  }
  void Remove(const std::string& /*instance*/, std::uint64_t /*tick*/) override {}
  void RemoveAll(const std::string& /*instance*/) override {}
  std::string DraftFolder() const override { return folder_.path(); }
  absl::StatusOr<std::vector<std::string>> Instances() override { return kept; }

  std::atomic<bool> held{false};
  std::atomic<int> puts{0};
  absl::Status put_fault, read_fault;                                          // set them while nothing is under way
  absl::StatusOr<std::vector<std::string>> kept = std::vector<std::string>();  // set it before there is a control plane

 private:
  static std::string KeyOf(const std::string& instance, std::uint64_t tick, const std::string& file) {
    return instance + "/" + std::to_string(tick) + "/" + file;
  }

  const std::string name_ = "held";
  const host::TemporaryFolder folder_;
  std::mutex mutex_;
  std::map<std::string, std::string> files_;
};

records::Bundle TestBundle(const v1::Scene& its_scene) {
  const std::string scene = its_scene.SerializeAsString();
  const PartitionMap map = *MakeGridMap({-50, -50, 50, 50}, 1);
  records::Bundle bundle;
  records::Manifest& manifest = *bundle.mutable_manifest();
  manifest.set_tick(60);
  manifest.set_scene_hash(SceneHash(its_scene));
  *manifest.mutable_map() = ToProto(map);
  manifest.set_snapshot_rate_hz(30);
  const std::string region = RegionFileName(map.regions()[0].id.value());
  for (const auto& [name, bytes] :
       {std::pair<std::string, std::string>(kSceneFile, scene), std::pair(region, std::string("state"))}) {
    records::ManifestFile& file = *manifest.add_files();
    file.set_name(name);
    file.set_size(bytes.size());
    file.set_hash(Sha256Hex(bytes));
    AddContent(bundle, name, bytes);
  }
  return bundle;
}

class CheckpointWaitsTest : public testing::Test {
 protected:
  CheckpointWaitsTest() {
    auto target = std::make_unique<HeldTarget>();
    target_ = target.get();
    // Nobody plays the host's agent, and no machine is so slow that it counts as lost.
    ControlSettings patient;
    patient.lost_after = patient.failover_after = std::chrono::hours(1);
    patient.start_timeout = kStartTimeout;
    plane_ = LoadPlane(store_, patient, std::make_unique<CheckpointFiles>(std::move(target)));
    plane_->Call([](Cluster& loaded, Now at) {
      v1::AddHostRequest request;
      request.set_name("alpha");
      request.set_max_regions(4);
      v1::AgentHello hello;
      hello.set_advertise_address("10.0.0.1");
      hello.mutable_resources()->set_region_capacity(4);
      hello.set_join_token(loaded.AddHost(at, request)->join_token());
      const auto admitted = loaded.HandleHello(at, hello);
      EXPECT_TRUE(admitted.ok()) << admitted.status();
      return 0;
    });
  }
  static constexpr std::chrono::minutes kStartTimeout{10};

  absl::StatusOr<v1::Instance> Import(const v1::Scene& scene = TestScene()) {
    auto draft = plane_->NewDraft();
    EXPECT_TRUE(draft.ok()) << draft.status();
    EXPECT_TRUE(draft->Append(Bundle(TestBundle(scene))).ok());
    return plane_->ImportCheckpoint({}, *draft);
  }
  std::vector<v1::Instance> All() {
    return plane_->Call([](Cluster& cluster, Now) {
      std::vector<v1::Instance> all;
      for (const auto& [number, instance] : cluster.state().instances()) {
        all.push_back(*GetInstance(cluster.state(), instance.record.id()));
      }
      return all;
    });
  }

  MemoryStore store_;
  HeldTarget* target_ = nullptr;
  std::unique_ptr<ControlPlane> plane_;
};

TEST_F(CheckpointWaitsTest, NobodyWaitsForAnImportButWhoImports) {
  target_->held = true;
  auto import = std::async(std::launch::async, [this] { return Import(); });
  const auto begun = [&] {
    return target_->puts > 0 || import.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
  };
  while (!begun()) std::this_thread::yield();
  ASSERT_EQ(All().size(), 1u) << "others are answered while its files are being kept";
  EXPECT_EQ(All()[0].state(), v1::INSTANCE_STATE_STARTING);
  target_->held = false;
  target_->held.notify_all();
  const auto made = import.get();
  ASSERT_TRUE(made.ok()) << made.status();
  v1::ListCheckpointsRequest list;
  list.set_id(made->id());
  const auto kept = plane_->Call([&](Cluster& cluster, Now) { return ListCheckpoints(cluster.state(), list); });
  ASSERT_TRUE(kept.ok()) << kept.status();
  ASSERT_EQ(kept->checkpoints_size(), 1);
  EXPECT_EQ(kept->checkpoints(0).tick(), 60u);
}

TEST_F(CheckpointWaitsTest, AnImportThatCannotBeKeptIsEndedAgain) {
  target_->put_fault = absl::UnavailableError("held: it is full of holes");
  const auto made = Import();
  EXPECT_EQ(made.status(), target_->put_fault);
  ASSERT_LE(All().size(), 1u);
  for (const v1::Instance& instance : All()) EXPECT_EQ(instance.state(), v1::INSTANCE_STATE_STOPPING);
}

TEST_F(CheckpointWaitsTest, AnImportWhoseSceneIsNotTheOneThatItNamesIsRefused) {
  auto draft = plane_->NewDraft();
  ASSERT_TRUE(draft.ok()) << draft.status();
  records::Bundle bundle = TestBundle(TestScene());
  bundle.mutable_manifest()->set_scene_hash(SceneHash(LargeScene()));
  ASSERT_TRUE(draft->Append(Bundle(bundle)).ok());
  EXPECT_EQ(plane_->ImportCheckpoint({}, *draft).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_TRUE(All().empty());
}

// The scene went with the world. It is stored again before the world is, and so without the lock of all others.
TEST_F(CheckpointWaitsTest, ARestoreOfAWorldThatHasFailedStoresALargeSceneInPieces) {
  const auto made = Import(LargeScene());
  ASSERT_TRUE(made.ok()) << made.status();
  const std::string key = SceneKey(made->scene_hash());
  plane_->Call([](Cluster& cluster, Now now) {
    now.steady += kStartTimeout + std::chrono::seconds(1);
    cluster.HandleTimer(now);
    return 0;
  });
  ASSERT_EQ(All()[0].state(), v1::INSTANCE_STATE_FAILED) << All()[0].reason();
  EXPECT_TRUE(absl::IsNotFound(store_.Get(key).status()));
  const auto patience = std::chrono::steady_clock::now() + kPatience;
  while (!store_.List("scene_piece/")->empty() && std::chrono::steady_clock::now() < patience) {
    std::this_thread::yield();
  }
  v1::RestoreInstanceRequest request;
  request.set_id(made->id());
  const auto restored = plane_->RestoreInstance(request);
  ASSERT_TRUE(restored.ok()) << restored.status();
  EXPECT_EQ(restored->instance().state(), v1::INSTANCE_STATE_STARTING);
  EXPECT_TRUE(ReadSceneRecord(store_.Get(key)->value).has_value()) << "its record names pieces";
  EXPECT_GE(store_.List("scene_piece/")->size(), 2U);
  const auto bytes = plane_->SceneBytes(made->scene_hash());
  ASSERT_TRUE(bytes.ok()) << bytes.status();
  v1::Scene read;
  ASSERT_TRUE(read.ParseFromString(*bytes));
  EXPECT_EQ(SceneHash(read), made->scene_hash());
}

// It would be set back to an older one, or be given up, though its newest checkpoint may be whole.
TEST_F(CheckpointWaitsTest, ACheckpointThatCannotBeReadNowIsNotTakenForDamaged) {
  const auto made = Import();
  ASSERT_TRUE(made.ok()) << made.status();
  target_->read_fault = absl::UnavailableError("no answer");
  v1::RestoreInstanceRequest request;
  request.set_id(made->id());
  request.set_validate_only(true);
  const auto restored = plane_->RestoreInstance(request);
  EXPECT_EQ(restored.status().code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(restored.status().message()), HasSubstr("no answer"));
  target_->read_fault = absl::DataLossError("has another checksum");
  EXPECT_EQ(plane_->RestoreInstance(request).status().code(), absl::StatusCode::kDataLoss);
}

// Their files stay: it may be the store that is too old.
TEST_F(CheckpointWaitsTest, CheckpointsOfWorldsThatTheStoreDoesNotKnowAreNamedOnceAndCounted) {
  const auto known = Import();
  ASSERT_TRUE(known.ok()) << known.status();
  EXPECT_EQ(plane_->stray_checkpoints(), 0U);
  plane_.reset();
  auto target = std::make_unique<HeldTarget>();
  target->kept = {known->id(), "inst-70", "inst-71", "lost+found"};
  const telemetry::CapturedLog log;
  plane_ = LoadPlane(store_, {}, std::make_unique<CheckpointFiles>(std::move(target)));
  const auto patience = std::chrono::steady_clock::now() + kPatience;
  const auto warned = [&] { return log.LinesWith("checkpoints of worlds that the store does not know"); };
  while (warned().empty() && std::chrono::steady_clock::now() < patience) std::this_thread::yield();
  EXPECT_EQ(plane_->stray_checkpoints(), 2U);
  plane_.reset();  // nothing is said any more
  ASSERT_EQ(warned().size(), 1U);
  EXPECT_THAT(warned()[0], testing::AllOf(HasSubstr("warning "), HasSubstr("worlds=2: inst-70, inst-71;")));
}

TEST_F(CheckpointWaitsTest, ATargetThatCannotListIsSaidToHaveKeptQuiet) {
  auto target = std::make_unique<HeldTarget>();
  target->kept = absl::UnavailableError("no answer");
  const telemetry::CapturedLog log;
  MemoryStore store;
  const auto plane = LoadPlane(store, {}, std::make_unique<CheckpointFiles>(std::move(target)));
  const auto patience = std::chrono::steady_clock::now() + kPatience;
  const auto warned = [&] { return log.LinesWith("checkpoints of unknown worlds are not looked for error=no answer"); };
  while (warned().empty() && std::chrono::steady_clock::now() < patience) std::this_thread::yield();
  EXPECT_EQ(warned().size(), 1U);
  EXPECT_EQ(plane->stray_checkpoints(), 0U);
}

}  // namespace
}  // namespace tessera::control
