#include "control_plane/players.h"

#include <gmock/gmock.h>

#include <map>
#include <string>
#include <utility>

namespace tessera::control {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

records::StoredPlayer Player(std::uint32_t number, const std::string& id = "") {
  records::StoredPlayer known;
  known.mutable_player()->set_number(number);
  known.mutable_player()->set_player_id(id);
  return known;
}

std::vector<std::uint32_t> NumbersOf(const Players& players) {
  std::vector<std::uint32_t> numbers;
  for (const records::StoredPlayer* known : players.All()) numbers.push_back(known->player().number());
  return numbers;
}

TEST(PlayersTest, AreFoundByNumberAndAscend) {
  Players players;
  for (const std::uint32_t number : {130, 2, 66, 1, 65, 2}) players.Put(Player(number));
  EXPECT_THAT(NumbersOf(players), ElementsAre(1, 2, 65, 66, 130));
  EXPECT_EQ(players.size(), 5U);
  EXPECT_EQ(players.Find(66)->player().number(), 66U);
  EXPECT_EQ(players.Find(194), nullptr);
  EXPECT_EQ(players.Find(3), nullptr);
  players.Erase(2);
  players.Erase(3);
  EXPECT_THAT(NumbersOf(players), ElementsAre(1, 65, 66, 130));
}

TEST(PlayersTest, WhoHasLeftIsNotPresentNorFoundByItsId) {
  Players players;
  players.Put(Player(1, "ada"));
  players.Put(Player(2, "bob"));
  players.Put(Player(3));
  EXPECT_EQ(players.FindId("bob"), 2U);
  EXPECT_EQ(players.FindId(""), 0U);
  players.Change(2, [](records::StoredPlayer& known) { known.mutable_player()->set_left(true); });
  players.Change(9, [](records::StoredPlayer& known) { known.mutable_player()->set_left(true); });
  EXPECT_EQ(players.present(), 2U);
  EXPECT_EQ(players.size(), 3U);
  EXPECT_EQ(players.FindId("bob"), 0U);
}

// Ten thousand come, change, leave and are forgotten: at each moment ids find whom a look at everybody would.
TEST(PlayersTest, IdsFindWhoIsThereAmongTenThousand) {
  constexpr std::uint32_t kPlayers = 10'000;
  const auto id_of = [](std::uint32_t number) { return "player-" + std::to_string(number); };
  Players players;
  for (std::uint32_t bucket = 0; bucket < Players::kBuckets; ++bucket) {
    records::PlayerBucket stored;
    for (std::uint32_t number = bucket; number <= kPlayers; number += Players::kBuckets) {
      if (number != 0) *stored.add_players() = Player(number, number % 7 == 0 ? "" : id_of(number));
    }
    ASSERT_TRUE(players.SetBucket(bucket, std::move(stored)).ok());
  }
  const Players before = players;
  std::map<std::string, std::uint32_t> there;
  for (std::uint32_t number = 1; number <= kPlayers; ++number) {
    if (number % 7 != 0) there[id_of(number)] = number;
  }
  for (std::uint32_t number = 1; number <= kPlayers; number += 13) {
    there.erase(id_of(number));
    switch (number % 4) {
      case 0:
        players.Erase(number);
        break;
      case 1:
        players.Change(number, [](records::StoredPlayer& known) { known.mutable_player()->set_left(true); });
        break;
      case 2:  // it comes back as another player
        players.Erase(number);
        players.Put(Player(number + kPlayers, id_of(number)));
        there[id_of(number)] = number + kPlayers;
        break;
      default:
        players.Put(Player(number, "new-" + std::to_string(number)));
        there["new-" + std::to_string(number)] = number;
    }
  }
  for (std::uint32_t number = 1; number <= kPlayers; ++number) {
    for (const std::string& id : {id_of(number), "new-" + std::to_string(number)}) {
      const auto known = there.find(id);
      ASSERT_EQ(players.FindId(id), known == there.end() ? 0U : known->second) << id;
    }
    ASSERT_EQ(before.FindId(id_of(number)), number % 7 == 0 ? 0U : number) << "a copy is as it was";
  }
}

TEST(PlayersTest, ACopyIsAsItWasAndDiffersInWhatChanged) {
  Players players;
  for (std::uint32_t number = 1; number <= 500; ++number) players.Put(Player(number));
  const Players before = players;
  EXPECT_THAT(players.BucketsUnlike(before), IsEmpty());
  players.Put(Player(7, "ada"));
  players.Erase(200);
  EXPECT_THAT(players.BucketsUnlike(before), ElementsAre(7, 200 % Players::kBuckets));
  EXPECT_EQ(before.Find(7)->player().player_id(), "");
  EXPECT_NE(before.Find(200), nullptr);
}

TEST(PlayersTest, TheSameButForWhoWasSeen) {
  Players players;
  players.Put(Player(1));
  Players other = players;
  other.Change(1, [](records::StoredPlayer& known) { known.set_unseen(true); });
  EXPECT_TRUE(players.ChangesSince(other).empty());
  other.Change(1, [](records::StoredPlayer& known) { known.mutable_player()->set_generation(2); });
  EXPECT_FALSE(players.ChangesSince(other).empty());
  EXPECT_FALSE(players.ChangesSince(Players()).empty());
  EXPECT_FALSE(Players().ChangesSince(players).empty());
}

TEST(PlayersTest, ChangesNameThoseAloneWhoDifferAscending) {
  Players players;
  for (std::uint32_t number = 1; number <= 500; ++number) players.Put(Player(number));
  const Players before = players;
  for (const std::uint32_t number : {501U, 3U, 130U}) players.Put(Player(number, "ada"));
  for (const std::uint32_t number : {400U, 2U}) players.Erase(number);
  const Players::Changes changes = players.ChangesSince(before);
  std::vector<std::uint32_t> numbers;
  for (const records::StoredPlayer* known : changes.players) numbers.push_back(known->player().number());
  EXPECT_THAT(numbers, ElementsAre(3, 130, 501));
  EXPECT_THAT(changes.forgotten, ElementsAre(2, 400));
  EXPECT_EQ(players.present(), 499U);
  players.Change(3, [](records::StoredPlayer& known) { known.mutable_player()->set_left(true); });
  EXPECT_EQ(players.present(), 498U);
}

TEST(PlayersTest, ABucketHasItsOwnAscending) {
  const auto set = [](std::uint32_t index, std::initializer_list<std::uint32_t> numbers) {
    records::PlayerBucket bucket;
    for (const std::uint32_t number : numbers) *bucket.add_players() = Player(number);
    Players players;
    const absl::Status status = players.SetBucket(index, bucket);
    EXPECT_TRUE(!status.ok() || players.size() == numbers.size());
    return status.code();
  };
  EXPECT_EQ(set(1, {1, 65, 129}), absl::StatusCode::kOk);
  EXPECT_EQ(set(1, {}), absl::StatusCode::kOk);
  EXPECT_EQ(set(1, {1, 2}), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(set(1, {65, 1}), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(set(1, {1, 1}), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(set(0, {0}), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(set(Players::kBuckets, {64}), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace tessera::control
