#include "core/game/message_calls.h"

#include <gmock/gmock.h>

#include "core/game/game_host.h"
#include "core/game/testing/fake_game_world.h"
#include "core/game/testing/scripted_game.h"

namespace tessera::game {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

constexpr std::uint16_t kCrateKind = 1;

class MessageCallsTest : public ::testing::Test {
 protected:
  using Arguments = ScriptedGame::Arguments;

  MessageCallsTest() : module_(game.module()) {
    world.Add(1, kCrateKind);
    world.Add(2, kCrateKind);
    world.Add(3, kCrateKind, false);
  }

  void Load() {
    auto loaded = GameHost::Load(module_, {"game.lua", ""}, world.shared_scene());
    ASSERT_TRUE(loaded.ok()) << loaded.status();
    host = *std::move(loaded);
  }
  void Touch(std::uint64_t tick, std::uint64_t self, std::uint64_t other) {
    const GameEvent event{kOnBodyContact, BodyId(self), BodyId(other)};
    host->Run(Tick(tick), {&event, 1}, world);
  }
  void Pass(std::uint64_t tick) { host->Run(Tick(tick), {}, world); }
  std::vector<std::string> Lines() {
    std::vector<std::string> lines;
    for (const GameLine& line : host->TakeLines()) lines.push_back(line.text);
    return lines;
  }

  FakeGameWorld world;
  ScriptedGame game;
  std::unique_ptr<GameHost> host;

 private:
  const tessera_game_module module_;
};

std::string NameIn(ScriptedGame::Arguments arguments, std::size_t at) {
  return {arguments[at].as.text, arguments[at].count};
}

TEST_F(MessageCallsTest, WithinARegionAMessageComesTwoTicksLater) {
  std::vector<std::string> got;
  game.On(kOnBodyContact, "crate", [](GameCalls& calls, Arguments) {
    return calls.Call(kBodySend, {BodyId(2), std::string("hit")});
  });
  game.On(kOnBodyMessage, "crate", [&](GameCalls&, Arguments arguments) {
    got.push_back(NameIn(arguments, 1));
    EXPECT_EQ(arguments[0].as.id, 2U);
    EXPECT_EQ(arguments[2].type, TESSERA_GAME_FIELDS);
    EXPECT_EQ(arguments[3].as.id, 1U) << "who sent it";
    return true;
  });
  Load();
  Touch(10, 1, 2);
  EXPECT_TRUE(world.together(2)) << "both ends were changed by one call";
  Pass(11);
  EXPECT_THAT(got, IsEmpty());
  Pass(12);
  EXPECT_THAT(got, ElementsAre("hit"));
  Pass(13);
  EXPECT_THAT(got, ElementsAre("hit"));
  EXPECT_TRUE(world.record(2).mail.inbox.empty());
  EXPECT_TRUE(world.record(1).mail.outbox.empty());
  const MessageStatistics& messages = host->statistics().messages;
  EXPECT_EQ(messages.sent, 1U);
  EXPECT_EQ(messages.applied, 1U);
  EXPECT_EQ(messages.by_hops[0], 1U);
  EXPECT_EQ(messages.most_ticks, 2U);
  EXPECT_EQ(messages.late, 0U);
}

TEST_F(MessageCallsTest, AMessageToAnotherRegionWaitsInTheOutbox) {
  game.On(kOnBodyContact, "crate", [](GameCalls& calls, Arguments) {
    return calls.Call(kBodySend, {BodyId(3), std::string("a")}) && calls.Call(kBodySend, {BodyId(3), std::string("b")});
  });
  Load();
  Touch(10, 1, 2);
  const Mail& mail = world.record(1).mail;
  ASSERT_EQ(mail.outbox.size(), 2U);
  EXPECT_EQ(mail.outbox[0].target, BodyId(3));
  EXPECT_EQ(mail.outbox[0].made, Tick(10));
  EXPECT_EQ(mail.outbox[1].after, mail.outbox[0].number);
  EXPECT_EQ(mail.outbox[1].what.speaker, BodyId(1));
}

TEST_F(MessageCallsTest, ACallThatFailsSendsNothing) {
  game.On(kOnBodyContact, "crate", [](GameCalls& calls, Arguments) {
    EXPECT_TRUE(calls.Call(kBodySend, {BodyId(2), std::string("a")}));
    EXPECT_TRUE(calls.Call(kBodySend, {BodyId(3), std::string("b")}));
    return false;
  });
  Load();
  Touch(10, 1, 2);
  EXPECT_TRUE(world.record(1).mail.empty());
  EXPECT_TRUE(world.record(2).mail.empty());
}

TEST_F(MessageCallsTest, ABodyMaySendAndGo) {
  game.On(kOnBodyContact, "crate", [](GameCalls& calls, Arguments) {
    return calls.Call(kBodyRemove, {BodyId(1)}) && calls.Call(kBodySend, {BodyId(3), std::string("bye")}) &&
           !calls.Call(kBodyImpulse, {BodyId(1), Vec3d{1, 0, 0}});
  });
  Load();
  Touch(10, 1, 2);
  EXPECT_THAT(world.ids(), ElementsAre(BodyId(2), BodyId(3)));
  EXPECT_EQ(world.commits(), 1) << "its last record";
}

TEST_F(MessageCallsTest, WhatCannotBeSentIsRefusedWithTheReason) {
  std::vector<std::string> errors;
  game.On(kOnBodyContact, "crate", [&](GameCalls& calls, Arguments) {
    const auto refused = [&](std::uint32_t function, const std::vector<GameValue>& arguments) {
      EXPECT_FALSE(calls.Call(function, arguments));
      errors.push_back(calls.error());
    };
    refused(kBodySend, {BodyId(77), std::string("a")});
    refused(kBodySend, {BodyId(3), std::string()});
    refused(kBodySend, {BodyId(3), std::string(33, 'x')});
    refused(kBodySend, {BodyId(3)});
    refused(kWorldSet, {std::string("score"), std::int64_t{1}});
    refused(kWorldAfter, {std::int64_t{5}, std::string("go")});
    refused(kWorldGet, {std::string("mana")});
    const std::string long_text(600, 'x');
    tessera_game_field field{"text", 4, {}};
    field.value.type = TESSERA_GAME_TEXT;
    field.value.count = static_cast<std::uint32_t>(long_text.size());
    field.value.as.text = long_text.data();
    std::vector<tessera_game_value> values(3);
    values[0] = ToInterface(GameValue(BodyId(3)));
    const GameValue name = std::string("a");
    values[1] = ToInterface(name);
    values[2].type = TESSERA_GAME_FIELDS;
    values[2].count = 1;
    values[2].as.fields = &field;
    EXPECT_FALSE(calls.CallRaw(kBodySend, values));
    errors.push_back(calls.error());
    for (std::size_t i = 0; i < kMaxOutbox; ++i) EXPECT_TRUE(calls.Call(kBodySend, {BodyId(3), std::string("a")}));
    refused(kBodySend, {BodyId(3), std::string("a")});
    return true;
  });
  Load();
  Touch(10, 1, 2);
  EXPECT_THAT(errors, ElementsAre("send: there is no body 77", "send: `name` must have 1 to 32 bytes",
                                  "send: `name` must have 1 to 32 bytes", "send: `name` is missing",
                                  "set: the world's record is owned by another region; send the world a message",
                                  "after: the world's record is owned by another region; send the world a message",
                                  HasSubstr("get: no property \"mana\""), HasSubstr("bytes, more than 512"),
                                  "send: the sender has 64 messages under way already, which nobody has acknowledged"));
}

TEST_F(MessageCallsTest, AFunctionOfAnotherRegionsBodyIsSentThere) {
  game.On(kOnBodyContact, "crate", [](GameCalls& calls, Arguments) {
    return calls.Call(kBodyImpulse, {BodyId(3), Vec3d{0, 4, 0}}) &&
           calls.Call(kBodySet, {BodyId(3), std::string("health"), std::int64_t{7}}) &&
           calls.Call(kBodyAfter, {BodyId(3), std::int64_t{9}, std::string("go")}) &&
           calls.Call(kBodyExpireAfter, {BodyId(3), std::int64_t{50}}) &&
           !calls.Call(kBodySet, {BodyId(3), std::string("health"), std::string("full")}) &&
           !calls.Call(kBodyCancel, {BodyId(3), std::int64_t{1}});
  });
  Load();
  Touch(10, 1, 2);
  const std::vector<SentMessage> sent = world.record(1).mail.outbox;
  ASSERT_EQ(sent.size(), 4U);

  // As body 3's region gets it.
  FakeGameWorld other;
  other.Add(3, kCrateKind);
  GameRecord record;
  for (const SentMessage& message : sent) {
    record.mail.Take({BodyId(1), message.number, message.after, message.made, Tick(14), 1, message.what}, Tick(13));
  }
  other.Commit(BodyId(3), {}, record, false);
  host->Run(Tick(14), {}, other);
  EXPECT_EQ(other.record(3).push_ns, (Vec3f{0, 4, 0}));
  EXPECT_EQ(other.property(3, "health"), PropertyValue(std::int64_t{7}));
  ASSERT_EQ(other.record(3).timers.size(), 1U);
  EXPECT_EQ(other.record(3).timers[0].due, Tick(23)) << "counted from where it is carried out";
  EXPECT_EQ(other.record(3).expires, Tick(64));
  EXPECT_THAT(Lines(), IsEmpty());
}

// Rotations, tables and what is left out before another argument go along, too.
TEST_F(MessageCallsTest, FunctionsWithOptionsAreCarriedOutElsewhere) {
  world.Add(3, kCrateKind, false);
  world.Add(4, kCrateKind, false);
  game.On(kOnBodyContact, "crate", [](GameCalls& calls, Arguments) {
    const GameValue friction{0.5}, spin{Vec3d{0, 0, 2}};
    const tessera_game_field material[] = {{"friction", 8, ToInterface(friction)}};
    const tessera_game_field options[] = {{"spin", 4, ToInterface(spin)}};
    tessera_game_value table{}, more{}, rotation{};
    table.type = more.type = TESSERA_GAME_FIELDS;
    table.count = more.count = 1;
    table.as.fields = material;
    more.as.fields = options;
    rotation.type = TESSERA_GAME_ROTATION;
    rotation.as.rotation[1] = 1;
    const tessera_game_value at = ToInterface(GameValue(Vec3d{1, 2, 3}));
    const tessera_game_value body = ToInterface(GameValue(BodyId(3))), other = ToInterface(GameValue(BodyId(4)));
    const tessera_game_value set[] = {body, table};
    const tessera_game_value put[] = {body, at, rotation, more};
    const tessera_game_value move[] = {other, at, tessera_game_value{}, ToInterface(GameValue(std::int64_t{30}))};
    return calls.CallRaw(kBodySetMaterial, set) && calls.CallRaw(kBodyTeleport, put) &&
           calls.CallRaw(kBodyMoveTo, move);
  });
  Load();
  Touch(10, 1, 2);
  EXPECT_THAT(Lines(), IsEmpty());
  const std::vector<SentMessage> sent = world.record(1).mail.outbox;
  ASSERT_EQ(sent.size(), 3U);
  // As the other bodies' region gets it.
  FakeGameWorld other;
  other.Add(3, kCrateKind);
  other.Add(4, kCrateKind);
  other.def(4).kinematic = true;
  for (const SentMessage& message : sent) {
    GameRecord record = other.record(message.target.value());
    record.mail.Take({BodyId(1), message.number, message.after, message.made, Tick(14), 1, message.what}, Tick(13));
    other.Commit(message.target, {}, record, false);
  }
  host->Run(Tick(14), {}, other);
  EXPECT_THAT(Lines(), IsEmpty());
  EXPECT_EQ(other.record(3).tuning.friction, 0.5F);
  ASSERT_TRUE(other.record(3).teleport.has_value());
  EXPECT_EQ(other.record(3).teleport->position, (Vec3d{1, 2, 3}));
  EXPECT_EQ(other.record(3).teleport->rotation, (Quatd{0, 1, 0, 0}));
  EXPECT_EQ(other.record(3).teleport->spin_rad_s, (Vec3f{0, 0, 2}));
  ASSERT_TRUE(other.record(4).target.has_value());
  EXPECT_EQ(other.record(4).target->arrives, Tick(44)) << "counted from where it is carried out";
}

TEST_F(MessageCallsTest, AFunctionThatFailsElsewhereIsALineThere) {
  Message message{BodyId(1), kBodyImpulse, {}, *EncodeFields({{"1", Vec3d{1e6, 0, 0}}})};
  GameRecord record;
  record.mail.Take({BodyId(1), 1, 0, Tick(1), Tick(5), 1, message}, Tick(3));
  world.Commit(BodyId(2), {}, record, false);
  Load();
  Pass(5);
  EXPECT_THAT(Lines(), ElementsAre(HasSubstr("asked for by body 1: impulse: makes a body of 2 kg faster")));
  EXPECT_EQ(host->statistics().messages.failed, 1U);
  EXPECT_TRUE(world.record(2).mail.inbox.empty()) << "it is over";
}

TEST_F(MessageCallsTest, TheWorldHasARecordLikeABody) {
  world.Add(kInstanceBody.value(), 0);
  std::vector<std::string> got;
  game.On(kOnBodyContact, "crate",
          [](GameCalls& calls, Arguments) { return calls.Call(kWorldSend, {std::string("goal")}); });
  game.On(kOnWorldMessage, "", [&](GameCalls& calls, Arguments arguments) {
    got.push_back(NameIn(arguments, 0));
    EXPECT_EQ(arguments[2].as.id, 1U);
    return calls.Call(kWorldAfter, {std::int64_t{3}, std::string("restart")});
  });
  game.On(kOnWorldTimer, "", [&](GameCalls& calls, Arguments arguments) {
    got.push_back(NameIn(arguments, 0));
    EXPECT_TRUE(calls.Call(kWorldIsOwn, {}));
    return calls.Call(kBodySend, {BodyId(2), std::string("restarted")});
  });
  game.On(kOnBodyMessage, "crate", [&](GameCalls&, Arguments arguments) {
    got.push_back(NameIn(arguments, 1));
    EXPECT_EQ(arguments[3].type, TESSERA_GAME_NOTHING) << "the world sent it";
    return true;
  });
  Load();
  Touch(10, 1, 2);
  for (std::uint64_t tick = 11; tick < 20; ++tick) Pass(tick);
  EXPECT_THAT(got, ElementsAre("goal", "restart", "restarted"));
  EXPECT_THAT(Lines(), IsEmpty());
}

// A message to whoever has no on_message is over and counted, and the first of each kind is a line.
TEST_F(MessageCallsTest, WhatNobodyHearsIsSaidOnceAKindAndCounted) {
  world.Add(kInstanceBody.value(), 0);
  world.Add(4, 2);
  world.Add(5, 0);
  game.On(kOnBodyContact, "crate", [](GameCalls& calls, Arguments) {
    bool sent = calls.Call(kWorldSend, {std::string("goal")});
    for (const std::uint64_t target : {2, 4, 5}) {
      sent = sent && calls.Call(kBodySend, {BodyId(target), std::string("hitt")});
    }
    return sent;
  });
  Load();
  Touch(10, 1, 2);
  Touch(11, 1, 2);
  for (std::uint64_t tick = 12; tick < 20; ++tick) Pass(tick);
  EXPECT_THAT(Lines(), UnorderedElementsAre("nobody hears the message \"hitt\": kinds.crate has no on_message",
                                            "nobody hears the message \"hitt\": kinds.ball has no on_message",
                                            "nobody hears the message \"hitt\": the body has no kind",
                                            "nobody hears the message \"goal\": game.lua has no function on_message"));
  EXPECT_EQ(host->statistics().messages.unheard, 8U);
  EXPECT_EQ(host->statistics().messages.applied, 8U);
  EXPECT_THAT(world.record(2).mail.inbox, IsEmpty()) << "it is over";
}

TEST_F(MessageCallsTest, APublishedEventWaitsInTheWorldsRecord) {
  world.Add(kInstanceBody.value(), 0);
  game.On(kOnBodyContact, "crate", [](GameCalls& calls, Arguments) {
    return calls.Call(kWorldPublish, {std::string("goal")}) && calls.Call(kWorldPublish, {std::string("bell")});
  });
  Load();
  Touch(10, 1, 2);
  for (std::uint64_t tick = 11; tick < 14; ++tick) Pass(tick);
  const Published& published = world.record(kInstanceBody.value()).published;
  ASSERT_EQ(published.waiting.size(), 2U);
  EXPECT_EQ(published.waiting[0]->name, "goal");
  EXPECT_EQ(published.waiting[0]->source, BodyId(1));
  EXPECT_EQ(published.waiting[0]->tick, Tick(12));
  EXPECT_EQ(published.waiting[1]->number, 2U);
  EXPECT_EQ(host->statistics().published, 2U);
  EXPECT_THAT(Lines(), IsEmpty());
}

TEST_F(MessageCallsTest, EventsThatFindNoRoomAreCountedAndSaidOnce) {
  world.Add(kInstanceBody.value(), 0);
  GameRecord record;
  PublishedEvent event;
  event.name = "old";
  while (record.published.Add(event)) {
  }
  record.published.left_out = 0;
  world.Commit(kInstanceBody, {}, record, false);
  game.On(kOnBodyContact, "crate", [](GameCalls& calls, Arguments) {
    return calls.Call(kWorldPublish, {std::string("goal")}) && calls.Call(kWorldPublish, {std::string("bell")});
  });
  Load();
  Touch(10, 1, 2);
  Pass(12);
  EXPECT_EQ(host->statistics().unpublished, 2U);
  EXPECT_EQ(world.record(kInstanceBody.value()).published.left_out, 2U);
  EXPECT_THAT(Lines(), ElementsAre(HasSubstr("\"goal\" and what follows are left out")));
}

TEST_F(MessageCallsTest, WhatCannotBePublishedNamesTheArgument) {
  world.Add(kInstanceBody.value(), 0);
  std::vector<std::string> errors;
  game.On(kOnBodyContact, "crate", [&](GameCalls& calls, Arguments) {
    EXPECT_FALSE(calls.Call(kWorldPublish, {std::string()}));
    errors.push_back(calls.error());
    EXPECT_FALSE(calls.Call(kWorldPublish, {std::string(33, 'x')}));
    errors.push_back(calls.error());
    return true;
  });
  Load();
  Touch(10, 1, 2);
  EXPECT_THAT(errors, ElementsAre(HasSubstr("publish: `name` must have 1 to 32 bytes"), HasSubstr("publish: `name`")));
}

TEST_F(MessageCallsTest, AMessageOfTheBackendSaysSoAndComesOnce) {
  int got = 0;
  game.On(kOnBodyMessage, "crate", [&](GameCalls&, Arguments arguments) {
    ++got;
    EXPECT_EQ(NameIn(arguments, 1), "gift");
    EXPECT_EQ(arguments[3].type, TESSERA_GAME_TEXT);
    EXPECT_EQ(NameIn(arguments, 3), "backend");
    return true;
  });
  GameRecord record;
  Message gift;
  gift.name = "gift";
  EXPECT_EQ(record.mail.TakeFromBackend(7, gift, Tick(4)), Mail::Arrival::kNew);
  EXPECT_EQ(record.mail.TakeFromBackend(7, gift, Tick(4)), Mail::Arrival::kRepeated);
  EXPECT_EQ(record.mail.TakeFromBackend(6, gift, Tick(4)), Mail::Arrival::kRepeated);
  world.Commit(BodyId(2), {}, record, false);
  Load();
  Pass(5);
  EXPECT_EQ(got, 1);
  EXPECT_TRUE(world.record(2).mail.inbox.empty());
  EXPECT_TRUE(world.record(2).mail.senders.empty()) << "nobody is reminded";
  EXPECT_EQ(world.record(2).mail.backend, 7U);
}

TEST_F(MessageCallsTest, BeyondATicksWorkMessagesWait) {
  int got = 0;
  game.On(kOnBodyMessage, "crate", [&](GameCalls& calls, Arguments) {
    ++got;
    return calls.Charge(19'000);
  });
  GameRecord record;
  for (std::uint64_t n = 1; n <= 10; ++n) {
    record.mail.TakeDirectly({BodyId(1), n, 0, Tick(1), Tick(5), 0, {BodyId(1), 0, "a", {}}});
  }
  world.Commit(BodyId(2), {}, record, false);
  Load();
  Pass(5);
  EXPECT_EQ(got, 6);
  EXPECT_EQ(host->statistics().messages.late, 0U);
  Pass(6);
  EXPECT_EQ(got, 10);
  EXPECT_EQ(host->statistics().messages.late, 4U);
}

}  // namespace
}  // namespace tessera::game
