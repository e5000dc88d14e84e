// Changes that find no room, hosts that are kept away from, and how a change is told that is done, under a virtual
// clock.
#include <gmock/gmock.h>

#include <algorithm>
#include <string>

#include "control_plane/cluster/queries.h"
#include "control_plane/testing/cluster_harness.h"

namespace tessera::control {
namespace {

using std::chrono::seconds;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

void Drain(ClusterHarness& harness, const std::string& name, bool undo = false) {
  v1::DrainHostRequest request;
  request.set_name(name);
  request.set_undo(undo);
  ASSERT_TRUE(harness.cluster().DrainHost(request).ok());
}

int EventsWith(const v1::Instance& instance, const std::string& text) {
  return static_cast<int>(
      std::count_if(instance.events().begin(), instance.events().end(),
                    [&](const v1::InstanceEvent& event) { return event.text().find(text) != std::string::npos; }));
}

v1::Host HostOf(ClusterHarness& harness, const std::string& name) {
  v1::GetHostRequest request;
  request.set_name(name);
  return GetHost(harness.cluster().state(), request)->host();
}

// Two hosts that are full with a world of four regions, of which beta is to be emptied.
class NoRoomTest : public ::testing::Test {
 protected:
  NoRoomTest() {
    harness_.AddHost("alpha", 2);
    harness_.AddHost("beta", 2);
    id_ = Start(harness_, 4);
    Drain(harness_, "beta");
    harness_.Run(seconds(10));
  }
  bool Waits() { return Summarise(harness_.cluster().state()).health.at(0).lacks_room; }

  ClusterHarness harness_;
  std::string id_;
};

TEST_F(NoRoomTest, ADrainSaysOnceWhatItWaitsForAndSinceWhen) {
  const std::string text =
      "waits for room: host beta is to be emptied, and region 5 needs a place; no ready host has one free: add a host, "
      "or let one take more regions";
  v1::Instance world = harness_.Get(id_);
  ASSERT_EQ(world.changes_size(), 1);
  EXPECT_EQ(world.changes(0).text(), text);
  EXPECT_TRUE(world.changes(0).lacks_room());
  const v1::InstanceEvent said = *world.events().rbegin();
  EXPECT_EQ(said.text(), text);
  EXPECT_TRUE(Waits());
  harness_.Run(seconds(120));
  world = harness_.Get(id_);
  EXPECT_EQ(world.state(), v1::INSTANCE_STATE_RUNNING);
  EXPECT_EQ(EventsWith(world, "waits for room"), 1);
  ASSERT_EQ(world.changes_size(), 1);
  EXPECT_EQ(world.changes(0).since().seconds(), said.time().seconds()) << "and not since it was last tried";

  harness_.AddHost("gamma", 2);
  harness_.Run(seconds(30));
  EXPECT_THAT(harness_.agents.at("beta").fake.workers, IsEmpty());
  ExpectSettled(harness_, id_, 4);
  ExpectEachBodyOnce(harness_, 4);
  EXPECT_FALSE(Waits());
  EXPECT_EQ(EventsWith(harness_.Get(id_), "waits for room"), 1);
}

TEST_F(NoRoomTest, AControlPlaneThatBeginsAnewShowsItAndMakesNoSecondEvent) {
  harness_.Restart();
  harness_.Run(seconds(10));
  ASSERT_EQ(harness_.Get(id_).changes_size(), 1);
  EXPECT_THAT(harness_.Get(id_).changes(0).text(), HasSubstr("host beta is to be emptied"));
  EXPECT_EQ(EventsWith(harness_.Get(id_), "waits for room"), 1);
}

TEST_F(NoRoomTest, ADrainThatIsUndoneWaitsForNothing) {
  Drain(harness_, "beta", true);
  harness_.Run(seconds(10));
  ExpectSettled(harness_, id_, 4);
  EXPECT_FALSE(Waits());
}

TEST(RoomTest, AHealthyRestartOfControlPlaneAndAgentsSaysNothing) {
  ClusterHarness harness;
  harness.AddHost("alpha", 4);
  harness.AddHost("beta", 4);
  const std::string id = Start(harness, 4);
  const int events = harness.Get(id).events_size();
  harness.Restart();
  harness.Run(seconds(5));
  for (auto& [name, agent] : harness.agents) agent.stream = 0;  // each attaches anew
  harness.Run(seconds(5));
  ExpectSettled(harness, id, 4);
  EXPECT_EQ(harness.Get(id).events_size(), events) << harness.Get(id).events().rbegin()->text();
  EXPECT_EQ(harness.Get(id).failovers(), 0U);
}

TEST(RoomTest, AWorldThatLostARegionSaysThatItsReplacementHasNoRoom) {
  ClusterHarness harness;
  harness.AddHost("alpha", 2);
  harness.AddHost("beta", 1);
  const std::string id = Start(harness, 3);
  FakeHost& beta = harness.agents.at("beta");
  const auto key = beta.fake.workers.begin()->first;
  beta.capacity = 0;
  harness.Attach(beta);  // again, and it takes none any more
  harness.Send(beta, beta.fake.Kill(key, 9));
  harness.Run(seconds(20));
  const v1::Instance world = harness.Get(id);
  EXPECT_EQ(world.failovers(), 1U);
  EXPECT_EQ(EventsWith(world, "waits for room: 3 regions are wanted, where 2 run, and region "), 1);
  EXPECT_EQ(world.changes_size(), 1);
}

TEST(RoomTest, AChangeThatIsDoneSaysWhoHasBegunAndWhoHasLeft) {
  ClusterHarness harness;
  harness.AddHost("alpha", 4);
  harness.AddHost("beta", 4);
  const std::string id = Start(harness, 2);
  ASSERT_TRUE(Scale(harness, id, 3).ok());
  harness.Run(seconds(5));
  const std::string host = &harness.AgentOf(id, 3) == &harness.agents.at("alpha") ? "alpha" : "beta";
  EXPECT_EQ(harness.Get(id).events().rbegin()->text(), "region 3 on " + host + " has begun: 3 regions run");
  ASSERT_TRUE(Scale(harness, id, 2).ok());
  harness.Run(seconds(5));
  EXPECT_THAT(harness.Get(id).events().rbegin()->text(), HasSubstr(" has left: 2 regions run"));
  v1::RestartWorkersRequest request;
  request.set_id(id);
  ASSERT_TRUE(harness.cluster().RestartWorkers(harness.now, request).ok());
  harness.Run(seconds(20));
  EXPECT_THAT(
      harness.Get(id).events().rbegin()->text(),
      testing::MatchesRegex("region [0-9] on [a-z]+ has begun, region [0-9] on [a-z]+ has left: 2 regions run"));
  EXPECT_EQ(EventsWith(harness.Get(id), "ended unseen"), 0) << "nobody died";
}

// Once nobody remembers how the change began, it is not told as another one.
TEST(RoomTest, AChangeThatAnotherLifeBeganIsSaidToBeDone) {
  ClusterHarness harness;
  harness.AddHost("alpha", 4);
  const std::string id = Start(harness, 2);
  ASSERT_TRUE(Scale(harness, id, 3).ok());
  harness.Exchange();  // the new worker starts
  harness.Restart();
  harness.Run(seconds(10));
  ExpectSettled(harness, id, 3);
  EXPECT_EQ(EventsWith(harness.Get(id), "a change is done: 3 regions run"), 1);
}

TEST(RoomTest, AHostWithoutFreePortsIsKeptAwayFromForTenMinutes) {
  ClusterHarness harness;
  harness.AddHost("alpha", 8);
  FakeHost& beta = harness.AddHost("beta", 8);
  const std::string id = Start(harness, 4);
  ASSERT_EQ(beta.fake.workers.size(), 2U);
  beta.fake.no_ports = true;
  harness.Send(beta, beta.fake.Kill(beta.fake.workers.begin()->first, 9));
  harness.Run(seconds(20));
  ExpectSettled(harness, id, 4);
  ExpectEachBodyOnce(harness, 4);
  EXPECT_EQ(beta.fake.workers.size(), 1U);
  EXPECT_EQ(beta.fake.starts.size(), 3U) << "it was chosen once more, as it had fewest, and never again";
  ASSERT_EQ(HostOf(harness, "beta").notes_size(), 1);
  EXPECT_THAT(HostOf(harness, "beta").notes(0), HasSubstr("no free ports for a worker"));
  EXPECT_THAT(HostOf(harness, "beta").notes(0), HasSubstr("--port-range"));
  EXPECT_EQ(HostOf(harness, "alpha").notes_size(), 0);
  beta.fake.no_ports = false;
  harness.Run(kNoPortsInterval - seconds(40));
  EXPECT_EQ(beta.fake.workers.size(), 1U);
  harness.Run(seconds(60));
  EXPECT_EQ(HostOf(harness, "beta").notes_size(), 0);
  EXPECT_EQ(beta.fake.workers.size(), 2U) << "it gets its share again";
  ExpectSettled(harness, id, 4);
}

TEST(RoomTest, AHostWithoutFreePortsIsTakenWhereNoOtherHasRoom) {
  ClusterHarness harness;
  harness.AddHost("alpha", 1);
  FakeHost& beta = harness.AddHost("beta", 4);
  const std::string id = Start(harness, 1);
  ASSERT_EQ(beta.fake.workers.size(), 1U) << "it has more room";
  beta.fake.no_ports = true;
  ASSERT_TRUE(Scale(harness, id, 3).ok());
  harness.Run(seconds(2));
  EXPECT_EQ(HostOf(harness, "beta").notes_size(), 1);
  beta.fake.no_ports = false;
  harness.Run(seconds(20));
  ExpectSettled(harness, id, 3);
}

}  // namespace
}  // namespace tessera::control
