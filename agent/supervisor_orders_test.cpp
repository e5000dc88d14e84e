// Orders that name players by what changed, from the control plane and to workers.
#include <gmock/gmock.h>

#include "agent/testing/supervisor_rig.h"

namespace tessera::agent {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class SupervisorOrdersTest : public SupervisorTest {
 protected:
  static v1::WorkerOrder Naming(std::uint64_t revision, const std::vector<std::uint32_t>& players,
                                std::uint64_t since = 0, const std::vector<std::uint32_t>& forgotten = {}) {
    v1::WorkerOrder order = Order(1, revision);
    for (const std::uint32_t player : players) order.add_players()->set_number(player);
    order.set_players_since(since);
    *order.mutable_players_forgotten() = {forgotten.begin(), forgotten.end()};
    return order;
  }
  static std::vector<std::uint32_t> PlayersIn(const v1::WorkerOrder& order) {
    std::vector<std::uint32_t> numbers;
    for (const v1::Player& player : order.players()) numbers.push_back(player.number());
    return numbers;
  }
  void AttachOneThat(bool takes_changes) {
    supervisor_.ContentReady(kScene, "/s");
    v1::WorkerReport report = Report(1);
    report.set_takes_player_changes(takes_changes);
    ASSERT_TRUE(supervisor_.Attached(report, PidOf(1)).ok());
    Carry();
  }
};

TEST_F(SupervisorOrdersTest, ChangesGoOnAsChangesSinceTheOrderThatWasSent) {
  Want({Naming(1, {1, 2, 3})});
  AttachOneThat(true);
  ASSERT_THAT(orders_, SizeIs(1));
  EXPECT_EQ(orders_[0].players_since(), 0U);
  Want({Naming(2, {4}, 1, {2})});
  ASSERT_THAT(orders_, SizeIs(2));
  EXPECT_EQ(orders_[1].players_since(), 1U);
  EXPECT_THAT(PlayersIn(orders_[1]), ElementsAre(4));
  EXPECT_THAT(orders_[1].players_forgotten(), ElementsAre(2));
  EXPECT_FALSE(Want({Naming(2, {}, 2)})[0].changed);
  EXPECT_THAT(orders_, SizeIs(2));
  EXPECT_THAT(PlayersIn(supervisor_.HeldOrders().orders(0)), ElementsAre(1, 3, 4));
  EXPECT_EQ(supervisor_.HeldOrders().orders(0).players_since(), 0U);
}

TEST_F(SupervisorOrdersTest, AWorkerThatAttachesAnewOrKnowsNoChangesGetsThemAll) {
  Want({Naming(1, {1, 2, 3})});
  Want({Naming(2, {4}, 1)});
  AttachOneThat(true);
  Want({Naming(3, {5}, 2)});
  supervisor_.Detached(Key(1));
  Want({Naming(4, {6}, 3)});
  ASSERT_THAT(orders_, SizeIs(2));
  EXPECT_THAT(PlayersIn(orders_[1]), ElementsAre(5));
  AttachOneThat(false);
  ASSERT_THAT(orders_, SizeIs(3));
  EXPECT_THAT(PlayersIn(orders_[2]), ElementsAre(1, 2, 3, 4, 5, 6));
  Want({Naming(5, {7}, 4)});
  ASSERT_THAT(orders_, SizeIs(4));
  EXPECT_EQ(orders_[3].players_since(), 0U);
  EXPECT_THAT(PlayersIn(orders_[3]), SizeIs(7));
}

TEST_F(SupervisorOrdersTest, ChangesSinceAnotherOrderAreNotTakenAndAWholeOneIsAskedFor) {
  Want({Naming(1, {1, 2, 3})});
  EXPECT_FALSE(supervisor_.TakeNeedsWhole());
  Want({Naming(5, {4}, 3)});
  EXPECT_TRUE(supervisor_.TakeNeedsWhole());
  EXPECT_FALSE(supervisor_.TakeNeedsWhole());
  EXPECT_THAT(PlayersIn(supervisor_.HeldOrders().orders(0)), ElementsAre(1, 2, 3));
  Want({Naming(5, {1, 4})});
  EXPECT_FALSE(supervisor_.TakeNeedsWhole());
  EXPECT_THAT(PlayersIn(supervisor_.HeldOrders().orders(0)), ElementsAre(1, 4));
}

TEST_F(SupervisorOrdersTest, ChangesForAWorkerThatIsNotThereStartNone) {
  Want({Naming(5, {4}, 3)});
  EXPECT_TRUE(supervisor_.TakeNeedsWhole());
  EXPECT_THAT(spawned_, IsEmpty());
  EXPECT_THAT(exits_, IsEmpty());
}

TEST_F(SupervisorOrdersTest, ManyJoinsAreWrittenToTheDiskOnceAndAnythingElseAtOnce) {
  Want({Naming(1, {1})});
  kept_.clear();
  for (std::uint32_t player = 2; player <= 100; ++player) Want({Naming(player, {player}, player - 1)});
  EXPECT_THAT(kept_, IsEmpty());
  EXPECT_EQ(supervisor_.NextDeadline(), now_ + kKeepPlayersInterval);
  Pass(kKeepPlayersInterval);
  ASSERT_THAT(kept_, SizeIs(1));
  EXPECT_THAT(PlayersIn(kept_[Key(1)]), SizeIs(100));
  kept_.clear();
  v1::WorkerOrder run = Naming(101, {101}, 100);
  run.set_run(true);
  Want({run});
  ASSERT_THAT(kept_, SizeIs(1));
  EXPECT_TRUE(kept_[Key(1)].run());
}

}  // namespace
}  // namespace tessera::agent
