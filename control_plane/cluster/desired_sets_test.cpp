// Desired sets on records and entries alone.
#include "control_plane/cluster/desired_sets.h"

#include <gtest/gtest.h>

#include "control_plane/testing/state_rig.h"

namespace tessera::control {
namespace {

class DesiredSetsTest : public ::testing::Test {
 protected:
  std::optional<v1::DesiredSet> Take() { return sets_.Take(alpha_.stream); }
  void SetState(v1::InstanceState state) {
    records::Instance next = instance_.record;
    next.set_state(state);
    ASSERT_TRUE(rig_.state->StoreInstance(instance_, next).ok());
    rig_.state->MarkOrders(instance_);
  }

  StateRig rig_;
  HostEntry& alpha_ = rig_.AddHost("alpha");
  InstanceEntry& instance_ = rig_.AddRunning({&alpha_, &alpha_});
  Requests requests_;
  Revocations revocations_{*rig_.state, SystemRandomBytes};
  DesiredSets sets_{*rig_.state, revocations_, [this](const InstanceEntry&) { return requests_; }};
  StreamId stream_ = rig_.state->OpenStream(alpha_, absl::OkStatus());
};

TEST_F(DesiredSetsTest, HoldsAllOrdersAndGivesANewRevisionOnlyToThoseThatChanged) {
  EXPECT_FALSE(Take()) << "nothing has changed";
  rig_.state->MarkOrders(instance_);
  const auto first = Take();
  ASSERT_TRUE(first && first->workers_size() == 2);
  EXPECT_FALSE(Take());
  rig_.state->MarkOrders(instance_);
  const auto second = Take();
  ASSERT_TRUE(second.has_value());
  EXPECT_GT(second->revision(), first->revision());
  EXPECT_EQ(second->workers(0).revision(), first->workers(0).revision());
  requests_.checkpoint_tick = 500;
  rig_.state->MarkOrders(instance_);
  const auto third = Take();
  EXPECT_EQ(third->workers(0).checkpoint().tick(), 500U);
  EXPECT_GT(third->workers(0).revision(), second->workers(0).revision());
}

TEST_F(DesiredSetsTest, AJoinNamesOnePlayerToAnAgentThatTakesChanges) {
  const auto join = [&](std::uint32_t number) {
    records::StoredPlayer known;
    known.mutable_player()->set_number(number);
    Players players = instance_.players;
    players.Put(known);
    ASSERT_TRUE(rig_.state->StoreWithPlayers(instance_, instance_.record, players).ok());
    rig_.state->MarkOrders(instance_);
  };
  for (std::uint32_t number = 1; number <= 1000; ++number) join(number);
  alpha_.takes_player_changes = true;
  const auto first = Take();
  EXPECT_EQ(first->workers(0).players_size(), 1000) << "the first on a stream is whole";
  EXPECT_EQ(first->workers(0).players_since(), 0U);
  join(1001);
  const auto second = Take();
  for (const int index : {0, 1}) {
    ASSERT_EQ(second->workers(index).players_size(), 1);
    EXPECT_EQ(second->workers(index).players(0).number(), 1001U);
    EXPECT_EQ(second->workers(index).players_since(), first->workers(index).revision());
    EXPECT_GT(second->workers(index).revision(), first->workers(index).revision());
  }
  EXPECT_LT(second->ByteSizeLong(), first->ByteSizeLong() / 4) << "it costs what one costs";
  Players players = instance_.players;
  players.Erase(7);
  ASSERT_TRUE(rig_.state->StoreWithPlayers(instance_, instance_.record, players).ok());
  rig_.state->MarkOrders(instance_);
  const auto third = Take();
  EXPECT_EQ(third->workers(0).players_size(), 0);
  ASSERT_EQ(third->workers(0).players_forgotten_size(), 1);
  EXPECT_EQ(third->workers(0).players_forgotten(0), 7U);
  // On another stream, and to an agent of an earlier release, all of them.
  stream_ = rig_.state->OpenStream(alpha_, absl::OkStatus());
  rig_.state->MarkOrders(instance_);
  EXPECT_EQ(Take()->workers(0).players_size(), 1000);
  alpha_.takes_player_changes = false;
  join(1002);
  EXPECT_EQ(Take()->workers(0).players_size(), 1001);
}

TEST_F(DesiredSetsTest, IsHeldBackWhileAWorkerIsMissingThatRanBefore) {
  instance_.workers[0].missed = 1;
  rig_.state->MarkOrders(instance_);
  EXPECT_FALSE(Take());
  instance_.workers[0].missed = 0;
  EXPECT_TRUE(Take());
}

TEST_F(DesiredSetsTest, TheFirstSetThatAsksForAWorkerIsNoted) {
  instance_.workers[0].asked_in = kUnasked;
  rig_.state->MarkOrders(instance_);
  const auto first = Take();
  ASSERT_TRUE(first);
  rig_.state->MarkOrders(instance_);
  EXPECT_TRUE(Take());
  EXPECT_EQ(instance_.workers[0].asked_in, first->revision());
  EXPECT_EQ(instance_.workers[1].asked_in, 0U) << "somebody may have asked for it";
}

TEST_F(DesiredSetsTest, WorkersAreAskedToEndAndThenWithdrawn) {
  SetState(v1::INSTANCE_STATE_STOPPING);
  const auto stopping = Take();
  ASSERT_TRUE(stopping && stopping->workers_size() == 2);
  EXPECT_TRUE(stopping->workers(0).stop());
  EXPECT_EQ(instance_.workers[0].ended_in, stopping->revision());
  instance_.withdrawn = true;
  rig_.state->MarkOrders(instance_);
  EXPECT_EQ(Take()->workers_size(), 0);
}

TEST_F(DesiredSetsTest, WhoWasNeverHeardOfIsNotStartedToBeEnded) {
  instance_.workers[0].reported = false;
  SetState(v1::INSTANCE_STATE_FAILED);
  const auto set = Take();
  ASSERT_TRUE(set && set->workers_size() == 1);
  EXPECT_EQ(set->workers(0).region(), 2U);
}

}  // namespace
}  // namespace tessera::control
