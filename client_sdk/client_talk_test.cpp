// Commands, events, names and the end of a session, of a client against a fake instance over real sockets.
#include <gmock/gmock.h>

#include "client_sdk/client_fixture.h"
#include "client_sdk/event_inbox.h"
#include "core/game/value.h"

namespace tessera::client {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

using ClientTalkTest = ClientFixture;

v1::PlayerNews News(std::uint32_t epoch, std::uint32_t last_command, std::uint32_t last_event,
                    const std::vector<std::string>& names = {}) {
  v1::PlayerNews news;
  news.set_epoch(epoch);
  news.set_last_command(last_command);
  news.set_last_event(last_event);
  for (const std::string& name : names) news.add_events()->set_name(name);
  return news;
}

std::vector<std::string> NamesOf(const std::vector<GameEvent>& events) {
  std::vector<std::string> names;
  names.reserve(events.size());
  for (const GameEvent& event : events) names.push_back(event.name);
  return names;
}

TEST_F(ClientTalkTest, CommandsGoUpUntilTheyAreTaken) {
  Make(1);
  Join();
  Play();
  ASSERT_TRUE(client->Send("jump").ok());
  ASSERT_TRUE(client->Send("shoot").ok());
  FakeRegion& region = *instance->regions[0];
  region.TellNews(News(1, 0, 0));
  ASSERT_TRUE(Until([&] { return region.commands.size() == 2; }));
  const std::uint32_t first = region.commands.begin()->first;
  EXPECT_THAT(region.commands, ElementsAre(std::pair(first, "jump"), std::pair(first + 1, "shoot")));
  region.commands.clear();
  ASSERT_TRUE(Until([&] { return !region.commands.empty(); }, true)) << "they are sent again";
  region.TellNews(News(1, first, 0));
  region.commands.clear();
  ASSERT_TRUE(Until([&] { return region.commands.size() == 1; }, true));
  EXPECT_EQ(region.commands.begin()->second, "shoot");
  region.RefuseCommand(first + 1, "the world runs no game", true);
  ASSERT_TRUE(Until([&] { return Count(ClientEvent::Kind::kCommandRefused) == 1; }));
  EXPECT_EQ(Find(ClientEvent::Kind::kCommandRefused)->detail, "the world runs no game");
  EXPECT_EQ(Find(ClientEvent::Kind::kCommandRefused)->input_number, first + 1);
}

TEST_F(ClientTalkTest, ACommandThatIsTooLongIsRefusedAtOnce) {
  Make(1);
  Join();
  EXPECT_EQ(client->Send(std::string(2048, 'x')).message(), "bytes: 2048 are more than 1024");
}

TEST_F(ClientTalkTest, EventsComeWithTheirValues) {
  Make(1);
  Join();
  Play();
  FakeRegion& region = *instance->regions[0];
  v1::PlayerNews news = News(1, 0, 1, {"score"});
  const auto values = game::EncodeFields({{"points", std::int64_t{3}}, {"team", std::string("red")}});
  news.mutable_events(0)->set_values(values->data(), values->size());
  region.TellNews(news);
  std::vector<GameEvent> events_of_game;
  ASSERT_TRUE(Until([&] {
    for (GameEvent& event : client->TakeGameEvents()) events_of_game.push_back(std::move(event));
    return !events_of_game.empty();
  }));
  EXPECT_EQ(events_of_game[0].name, "score");
  ASSERT_THAT(events_of_game[0].values, SizeIs(2));
  EXPECT_EQ(events_of_game[0].values[0].first, "points");
  EXPECT_EQ(std::get<std::int64_t>(events_of_game[0].values[0].second), 3);
  ASSERT_TRUE(Until([&] { return region.last_event == 1; })) << "the region learns that it is here";
}

TEST(EventInboxTest, PassesOverWhatIsHereAndWhatIsOutOfDate) {
  EventInbox inbox;
  const auto take = [&](std::uint32_t epoch, std::uint32_t last, const std::vector<std::string>& names) {
    if (!inbox.Accept(epoch)) return;
    std::vector<GameEvent> came;
    came.reserve(names.size());
    for (const std::string& name : names) came.push_back({name});
    inbox.Take(last, std::move(came));
  };
  take(4, 12, {"a", "b"});
  EXPECT_THAT(NamesOf(inbox.TakeAll()), ElementsAre("a", "b")) << "those before were an earlier process's";
  take(5, 13, {"a", "b", "c"});
  EXPECT_THAT(NamesOf(inbox.TakeAll()), ElementsAre("c")) << "a new owner sends what it does not know to be here";
  take(4, 12, {"b"});
  EXPECT_THAT(NamesOf(inbox.TakeAll()), IsEmpty()) << "the old owner, late";
  EXPECT_EQ(inbox.last(), 13U);
  inbox.AllLost();
  take(2, 11, {"x"});
  EXPECT_THAT(NamesOf(inbox.TakeAll()), ElementsAre("x")) << "a world that was restored counts from where it was";
  EXPECT_EQ(inbox.last(), 11U);
}

TEST_F(ClientTalkTest, TheGameEndsTheSessionInItsOwnWords) {
  Make(2);
  Join();
  Play();
  instance->regions[1]->TellEnded("you were idle");
  ASSERT_TRUE(Until([&] { return client->state() == ClientState::kEnded; }));
  EXPECT_EQ(client->reason().code(), absl::StatusCode::kAborted);
  EXPECT_EQ(client->reason().message(), "you were idle");
  EXPECT_EQ(Find(ClientEvent::Kind::kEnded)->detail, "you were idle");
  EXPECT_FALSE(client->Send("jump").ok());
}

TEST_F(ClientTalkTest, OneWhoIsRefusedWhileItJoinsReadsWhy) {
  Make(1);
  instance->regions[0]->refuse_all.emplace();
  instance->regions[0]->refuse_all->set_reason(v1::REFUSAL_REASON_SESSION_ENDED);
  instance->regions[0]->refuse_all->set_detail("the match has begun");
  Join();
  ASSERT_TRUE(Until([&] { return client->state() == ClientState::kEnded; }));
  EXPECT_EQ(client->reason(), absl::AbortedError("the match has begun"));
}

// Two regions tell of the world, one of them later than the other.
TEST_F(ClientTalkTest, TheNewestPropertiesOfTheWorldCount) {
  Make(2);
  Join();
  Play();
  const std::vector<PropertyDef>& defs = client->scene().instance_properties;
  ASSERT_EQ(defs.size(), 2U);
  const auto world = [&](std::int64_t goals, const char* phase) {
    PropertySet set;
    EXPECT_TRUE(set.Set(defs, "goals", goals).ok() && set.Set(defs, "phase", std::string(phase)).ok());
    return set.Encode();
  };
  const auto goals = [&] { return std::get<std::int64_t>(*client->WorldPropertyOf("goals")); };
  EXPECT_EQ(goals(), 0);
  EXPECT_EQ(client->WorldPropertyOf("lives"), std::nullopt);
  instance->regions[0]->TellWorld(1, 20, world(3, "waiting"));
  ASSERT_TRUE(Until([&] { return goals() == 3; }));
  EXPECT_EQ(Count(ClientEvent::Kind::kWorldPropertyChanged), 1) << "the phase is as it was";
  EXPECT_EQ(Find(ClientEvent::Kind::kWorldPropertyChanged)->property, "goals");
  instance->regions[1]->TellWorld(1, 10, world(2, "waiting"));
  instance->regions[1]->TellWorld(1, 20, world(3, "waiting"));
  instance->regions[1]->TellWorld(2, 5, world(4, "play"));
  ASSERT_TRUE(Until([&] { return goals() == 4; })) << "of a newer owner of the world's record";
  EXPECT_EQ(client->WorldPropertyOf("phase"), PropertyValue(std::string("play")));
  EXPECT_EQ(Count(ClientEvent::Kind::kWorldPropertyChanged), 3) << "what is older, or known, changes nothing";
  instance->regions[0]->TellWorld(3, 1, {1, 2, 3});
  instance->regions[0]->TellWorld(3, 2, world(5, "play"));
  ASSERT_TRUE(Until([&] { return goals() == 5; })) << "what is malformed is passed over";
}

TEST_F(ClientTalkTest, KnowsTheNamesOfPlayersInSightAndWhereItLooksFrom) {
  Make(1);
  Join();
  Play();
  PropertySet named;
  named.set_player_name("Ада");
  const auto bytes = std::make_shared<const std::vector<std::uint8_t>>(named.Encode());
  const PlayerNumber ada(7);
  Advance([&](Tick t) {
    const std::vector<replication::BodyRecord> bodies = {{PlayerBodyId(ada), Epoch(1), Moving(0, 0), bytes}};
    instance->regions[0]->Snapshot(t, bodies);
  });
  EXPECT_EQ(client->NameOf(ada), "Ада");
  EXPECT_EQ(client->NameOf(PlayerNumber(8)), "");
  EXPECT_FALSE(client->spectator_view().has_value());
  v1::PlayerNews news = News(1, 0, 0);
  news.set_spectating(true);
  news.set_view_y(20);
  instance->regions[0]->TellNews(news);
  ASSERT_TRUE(Until([&] { return client->spectator_view().has_value(); }));
  EXPECT_EQ(*client->spectator_view(), (Vec3d{0, 20, 0}));
}

TEST_F(ClientTalkTest, TheOwnBodyIsTheOneThatInputsMove) {
  Make(1);
  Join();
  Play();
  const BodyId own = client->own_body();
  v1::PlayerNews news = News(1, 0, 0);
  news.set_controlled_body(1);
  instance->regions[0]->TellNews(news);
  ASSERT_TRUE(Until([&] { return client->own_body() == BodyId(1); }));
  EXPECT_FALSE(client->spectator_view().has_value());
  news.clear_controlled_body();
  instance->regions[0]->TellNews(news);
  ASSERT_TRUE(Until([&] { return client->own_body() == own; }));
}

}  // namespace
}  // namespace tessera::client
