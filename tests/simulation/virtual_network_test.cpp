// The network under the simulator keeps its promises under any network conditions.
#include "tests/simulation/virtual_network.h"

#include <gmock/gmock.h>

namespace tessera::simulation {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

class VirtualNetworkTest : public ::testing::Test {
 protected:
  VirtualNetworkTest() {
    Join(1);
    Join(2);
    network.Link(1, 2);
    RunFor(Milliseconds(100));
  }
  void Join(Node node) {
    network.Join(node, {.on_connected = [this, node](Node) { ++connected[node]; },
                        .on_disconnected = [this, node](Node) { ++broken[node]; },
                        .on_message = [this, node](Node, const Bytes& bytes) { got[node].push_back(bytes.at(0)); },
                        .on_datagram = [this, node](Node, const Bytes& bytes) { told[node].push_back(bytes.at(0)); }});
  }
  void RunFor(Micros time) {
    const Micros end = timeline.now() + time;
    while (!timeline.empty() && timeline.next() <= end) timeline.RunNext();
  }

  Timeline timeline;
  VirtualNetwork network{timeline, 7};
  std::map<Node, int> connected, broken;
  std::map<Node, std::vector<int>> got, told;
};

TEST_F(VirtualNetworkTest, AConnectionBringsEachMessageOnceAndInOrderInAnyWeather) {
  network.conditions() = {.loss = 0.3, .delay = 2000, .jitter = 20'000, .reorder = 0.3, .duplicate = 0.3};
  std::vector<int> sent;
  for (int i = 0; i < 200; ++i) {
    ASSERT_TRUE(network.Send(1, 2, {static_cast<std::uint8_t>(i)}));
    sent.push_back(i);
    RunFor(Milliseconds(1));
  }
  RunFor(1'000'000);
  EXPECT_EQ(got[2], sent);
  EXPECT_GT(network.totals().lost, 20U);
  EXPECT_GT(network.totals().duplicates, 20U);
}

TEST_F(VirtualNetworkTest, DatagramsAreLostDoubledAndOvertaken) {
  network.conditions() = {.loss = 0.2, .delay = 2000, .jitter = 20'000, .reorder = 0, .duplicate = 0.2};
  for (int i = 0; i < 100; ++i) network.SendDatagram(1, 2, {static_cast<std::uint8_t>(i)});
  RunFor(Milliseconds(100));
  EXPECT_LT(std::set(told[2].begin(), told[2].end()).size(), 95U);
  EXPECT_GT(told[2].size(), std::set(told[2].begin(), told[2].end()).size());
  EXPECT_FALSE(std::is_sorted(told[2].begin(), told[2].end()));
}

TEST_F(VirtualNetworkTest, ACutBreaksTheConnectionAndItsEndMendsIt) {
  network.Cut(1, 2, true);
  ASSERT_TRUE(network.Send(1, 2, {5}));
  RunFor(2 * VirtualNetwork::kBreakAfter);
  EXPECT_EQ(broken[1], 1);
  EXPECT_EQ(broken[2], 1);
  EXPECT_FALSE(network.Send(1, 2, {6}));
  network.Cut(1, 2, false);
  RunFor(Milliseconds(500));
  EXPECT_EQ(connected[1], 2);
  EXPECT_THAT(got[2], IsEmpty());
  ASSERT_TRUE(network.Send(1, 2, {7}));
  RunFor(Milliseconds(500));
  EXPECT_THAT(got[2], ElementsAre(7));
}

TEST_F(VirtualNetworkTest, AProcessThatStandsStillHearsAllOfItLater) {
  network.SetStalled(2, true);
  for (const std::uint8_t i : Bytes{1, 2, 3}) ASSERT_TRUE(network.Send(1, 2, {i}));
  RunFor(Milliseconds(300));
  EXPECT_THAT(got[2], IsEmpty());
  network.SetStalled(2, false);
  RunFor(Milliseconds(300));
  EXPECT_THAT(got[2], ElementsAre(1, 2, 3));
}

TEST_F(VirtualNetworkTest, ANewLifeGetsNothingOfTheLast) {
  network.conditions().delay = Milliseconds(50);
  ASSERT_TRUE(network.Send(1, 2, {1}));
  network.Leave(2);
  Join(2);
  RunFor(Milliseconds(1000));
  EXPECT_THAT(got[2], IsEmpty());
  EXPECT_EQ(connected[2], 2);
  EXPECT_TRUE(network.Connected(1, 2));
}

// All that one side says comes through, until nobody acknowledges it.
TEST_F(VirtualNetworkTest, ACutOneWayIsHeardByTheOtherUntilTheConnectionEnds) {
  network.CutOneWay(2, 1, true);
  ASSERT_TRUE(network.Send(1, 2, {1}));
  RunFor(Milliseconds(500));
  EXPECT_THAT(got[2], ElementsAre(1));
  EXPECT_TRUE(network.Connected(1, 2));
  RunFor(Milliseconds(5000));
  EXPECT_FALSE(network.Connected(1, 2)) << "and there is no handshake";
  EXPECT_EQ(broken[1], 1);
  network.CutOneWay(2, 1, false);
  RunFor(Milliseconds(100));
  EXPECT_TRUE(network.Connected(1, 2));
}

TEST_F(VirtualNetworkTest, PlacesOfOneIslandHearEachOtherAndNobodyElse) {
  Join(3);
  network.Link(1, 3);
  network.SetPlace(1, 11);
  network.SetPlace(2, 12);
  network.SetPlace(3, 13);
  network.MovePlace(11, 1);
  network.MovePlace(12, 1);
  EXPECT_TRUE(network.Passes(1, 2));
  EXPECT_FALSE(network.Passes(1, 3));
  EXPECT_FALSE(network.Passes(3, 2));
  network.MovePlace(11, 0);
  EXPECT_TRUE(network.Passes(1, 3));
  EXPECT_FALSE(network.Passes(1, 2));
}

}  // namespace
}  // namespace tessera::simulation
