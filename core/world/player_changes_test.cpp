#include "core/world/player_changes.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace tessera {
namespace {

v1::WorkerOrder Order(std::uint64_t revision, const std::vector<std::pair<std::uint32_t, std::string>>& players,
                      std::uint64_t since = 0, const std::vector<std::uint32_t>& forgotten = {}) {
  v1::WorkerOrder order;
  order.set_revision(revision);
  for (const auto& [number, name] : players) {
    v1::Player& player = *order.add_players();
    player.set_number(number);
    player.set_name(name);
  }
  order.set_players_since(since);
  *order.mutable_players_forgotten() = {forgotten.begin(), forgotten.end()};
  return order;
}

v1::WorkerOrder Completed(const v1::WorkerOrder& before, v1::WorkerOrder next) {
  EXPECT_TRUE(Continues(before, next));
  CompletePlayers(before, next);
  return next;
}

TEST(PlayerChangesTest, AWholeOrderBecomesAsTheNextOneSays) {
  const v1::WorkerOrder whole = Order(7, {{1, "a"}, {3, "c"}, {9, "i"}});
  EXPECT_EQ(Completed(whole, Order(8, {{2, "b"}, {3, "C"}, {12, "l"}}, 7, {9})).DebugString(),
            Order(8, {{1, "a"}, {2, "b"}, {3, "C"}, {12, "l"}}).DebugString());
  EXPECT_EQ(Completed(whole, Order(8, {{4, "d"}})).DebugString(), Order(8, {{4, "d"}}).DebugString())
      << "a whole one takes the place of all";
}

TEST(PlayerChangesTest, ChangesAfterChangesAreTheSameAsBothOneAfterTheOther) {
  const v1::WorkerOrder whole = Order(7, {{1, "a"}, {3, "c"}, {9, "i"}});
  const v1::WorkerOrder second = Order(8, {{2, "b"}, {3, "C"}}, 7, {9});
  const v1::WorkerOrder third = Order(9, {{9, "I"}, {10, "k"}}, 8, {1, 2});
  const v1::WorkerOrder both = Completed(second, third);
  EXPECT_EQ(both.players_since(), 7U);
  EXPECT_EQ(Completed(whole, both).DebugString(), Completed(Completed(whole, second), third).DebugString());
  EXPECT_EQ(Completed(whole, both).DebugString(), Order(9, {{3, "C"}, {9, "I"}, {10, "k"}}).DebugString());
}

TEST(PlayerChangesTest, ChangesSinceAnotherOrderDoNotContinueIt) {
  EXPECT_FALSE(Continues(Order(7, {}), Order(9, {}, 8)));
  EXPECT_TRUE(Continues(Order(7, {}), Order(9, {})));
}

}  // namespace
}  // namespace tessera
