#include "control_plane/cluster/world_releases.h"

#include <gmock/gmock.h>

#include <string>
#include <vector>

#include "control_plane/cluster/orders.h"
#include "control_plane/testing/state_rig.h"

namespace tessera::control {
namespace {

using std::chrono::seconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class WorldReleasesTest : public ::testing::Test {
 protected:
  // `releases`: as its agent lists them; none: it is of before agents did.
  HostEntry& AddHost(const std::string& name, const std::string& version, const std::vector<std::string>& releases,
                     std::uint32_t places = 8) {
    HostEntry& host = rig_.AddHost(name, places);
    records::Host next = host.record;
    next.set_version(version);
    for (const std::string& release : releases) next.add_releases(release);
    EXPECT_TRUE(rig_.state->StoreHost(host, next).ok());
    return host;
  }
  absl::StatusOr<BeginningPlan> Plan(ReleaseChoice choice, const std::string& own = "", std::uint32_t regions = 2) {
    return PlaceBeginning(*rig_.state, *MakeGridMap({0, 0, 100, 100}, regions), {.threads = 1, .release = own}, nullptr,
                          choice, seconds(1), rig_.now);
  }
  std::string ReleaseOf(ReleaseChoice choice, const std::string& own = "", std::uint32_t regions = 2) {
    const auto plan = Plan(choice, own, regions);
    return plan.ok() ? plan->release : plan.status().ToString();
  }

  StateRig rig_;
};

TEST_F(WorldReleasesTest, AnAgentThatListsNoneHasItsOwn) {
  EXPECT_THAT(ReleasesOf(AddHost("alpha", "0.1.0", {}).record), ElementsAre("0.1.0"));
  EXPECT_THAT(ReleasesOf(AddHost("beta", "0.2.0", {"0.1.0", "0.2.0"}).record), ElementsAre("0.1.0", "0.2.0"));
  const HostEntry& silent = AddHost("gamma", "", {});
  EXPECT_THAT(ReleasesOf(silent.record), IsEmpty());
  EXPECT_TRUE(HasRelease(silent.record, "0.2.0"));
}

TEST_F(WorldReleasesTest, AWorldRunsWhereItsReleaseIs) {
  AddHost("alpha", "0.1.0", {});
  AddHost("beta", "0.2.0", {"0.1.0", "0.2.0"});
  AddHost("gamma", "0.2.0", {"0.2.0"});
  const auto names = [&](const std::string& release) {
    std::vector<std::string> found;
    for (const FreeHost& host : FreeHosts(*rig_.state, {.threads = 1, .release = release}, nullptr)) {
      found.push_back(rig_.state->FindHost(host.id)->record.name());
    }
    return found;
  };
  EXPECT_THAT(names("0.1.0"), ElementsAre("alpha", "beta"));
  EXPECT_THAT(names("0.2.0"), ElementsAre("beta", "gamma"));
  EXPECT_THAT(names(""), ElementsAre("alpha", "beta", "gamma"));
}

TEST_F(WorldReleasesTest, ANewWorldGetsTheReleaseThatMostHostsHave) {
  AddHost("alpha", "0.1.0", {});
  AddHost("beta", "0.1.0", {});
  EXPECT_EQ(ReleaseOf(ReleaseChoice::kCommon), "0.1.0");
  AddHost("gamma", "0.2.0", {"0.1.0", "0.2.0"});
  EXPECT_EQ(ReleaseOf(ReleaseChoice::kCommon), "0.1.0") << "in the middle of an upgrade of the cluster";
}

TEST_F(WorldReleasesTest, OfEquallyCommonOnesItIsTheNewest) {
  AddHost("alpha", "0.10.0", {"0.9.0", "0.10.0"});
  AddHost("beta", "0.10.0", {"0.9.0", "0.10.0"});
  EXPECT_EQ(ReleaseOf(ReleaseChoice::kCommon), "0.10.0");
}

TEST_F(WorldReleasesTest, WithoutRoomForTheCommonOneAnotherIsTaken) {
  AddHost("alpha", "0.1.0", {}, 1);
  AddHost("beta", "0.1.0", {}, 1);
  AddHost("gamma", "0.2.0", {}, 8);
  EXPECT_EQ(ReleaseOf(ReleaseChoice::kCommon, "", 2), "0.1.0");
  EXPECT_EQ(ReleaseOf(ReleaseChoice::kCommon, "", 4), "0.2.0");
  const absl::Status status = Plan(ReleaseChoice::kCommon, "", 9).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(status.message()), HasSubstr("without release 0.1.0: gamma (has release 0.2.0)"));
}

TEST_F(WorldReleasesTest, AWorldThatBeginsAnewKeepsItsReleaseWhereAHostHasIt) {
  AddHost("alpha", "0.2.0", {"0.1.0", "0.2.0"}, 2);
  AddHost("beta", "0.2.0", {"0.2.0"});
  EXPECT_EQ(ReleaseOf(ReleaseChoice::kKept, "0.1.0", 2), "0.1.0");
  EXPECT_EQ(Plan(ReleaseChoice::kKept, "0.1.0", 3).status().code(), absl::StatusCode::kResourceExhausted)
      << "it waits for room, and is not upgraded unasked";
}

TEST_F(WorldReleasesTest, OneWhoseReleaseNobodyHasAnyMoreBeginsWithAnother) {
  AddHost("alpha", "0.2.0", {"0.2.0"});
  EXPECT_EQ(ReleaseOf(ReleaseChoice::kKept, "0.1.0"), "0.2.0");
}

TEST_F(WorldReleasesTest, AnUpgradeGoesToTheNewestAndNeverBack) {
  AddHost("alpha", "0.2.0", {"0.1.0", "0.2.0"});
  AddHost("beta", "0.1.0", {});
  EXPECT_EQ(ReleaseOf(ReleaseChoice::kNewest, "0.1.0"), "0.2.0");
  EXPECT_EQ(ReleaseOf(ReleaseChoice::kNewest, "0.2.0"), "0.2.0");
  EXPECT_EQ(ReleaseOf(ReleaseChoice::kNewest, "0.1.0", 12), "0.1.0") << "there is no room for it with the newest";
  EXPECT_FALSE(Plan(ReleaseChoice::kNewest, "0.2.0", 12).ok());
}

TEST_F(WorldReleasesTest, HostsThatSayNoReleaseTakeAnyWorld) {
  rig_.AddHost("alpha");
  EXPECT_EQ(ReleaseOf(ReleaseChoice::kCommon), "");
  EXPECT_EQ(ReleaseOf(ReleaseChoice::kKept, "0.1.0"), "0.1.0");
}

TEST_F(WorldReleasesTest, WorldsOfBeforeAreOfTheFirstReleaseAndTheirOrdersSaySo) {
  HostEntry& alpha = AddHost("alpha", "0.1.0", {});
  HostEntry& beta = AddHost("beta", "0.1.0", {});
  InstanceEntry& old = rig_.AddRunning({&alpha, &beta});
  InstanceEntry& other = rig_.AddRunning({&alpha, &beta});
  records::Instance next = other.record;
  next.set_release("0.2.0");
  ASSERT_TRUE(rig_.state->StoreInstance(other, next).ok());
  ASSERT_TRUE(GiveReleases(*rig_.state).ok());
  EXPECT_EQ(old.record.release(), "0.1.0");
  EXPECT_EQ(other.record.release(), "0.2.0");
  EXPECT_EQ(MakeOrder(old, 0, {}).release(), "0.1.0");
}

TEST_F(WorldReleasesTest, AnotherReleaseIsAnEvent) {
  records::Instance record;
  SetRelease("0.1.0", rig_.now, record);
  EXPECT_TRUE(record.events().empty()) << "it begins with it";
  SetRelease("0.1.0", rig_.now, record);
  EXPECT_TRUE(record.events().empty());
  SetRelease("0.2.0", rig_.now, record);
  ASSERT_EQ(record.events_size(), 1);
  EXPECT_EQ(record.events(0).text(), "its workers are of release 0.2.0 now, and were of 0.1.0");
}

}  // namespace
}  // namespace tessera::control
