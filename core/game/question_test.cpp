// Questions and answers as they travel, and as a game asks and gets them.
#include "core/game/question.h"

#include <gmock/gmock.h>

#include <functional>
#include <limits>
#include <utility>

#include "core/game/game_host.h"
#include "core/game/testing/fake_game_world.h"
#include "core/game/testing/scripted_game.h"
#include "game_sdk/api/api.h"

namespace tessera::game::question_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

Question Sweep() {
  Question question;
  question.query.shape = CapsuleShape{0.5, 1};
  question.query.from = {1, 2, 3};
  question.query.to = {4, 5, 6};
  question.query.filter.layers = 5;
  question.query.filter.triggers = true;
  question.query.filter.ignored = {BodyId(7), BodyId(9)};
  question.query.most_hits = 3;
  question.query.at_tick = 99.25;
  return question;
}

TEST(QuestionTest, AQueryComesOutAsItWentIn) {
  const FakeGameWorld world;
  const auto back = DecodeQuestion(EncodeQuestion(Sweep()), world.scene());
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(EncodeQuestion(*back), EncodeQuestion(Sweep()));
  EXPECT_EQ(back->query.to, (Vec3d{4, 5, 6}));
  EXPECT_EQ(back->query.at_tick, 99.25);
  EXPECT_THAT(back->query.filter.ignored, ElementsAre(BodyId(7), BodyId(9)));
}

TEST(QuestionTest, WhatIsNotSoundIsRefused) {
  const FakeGameWorld world;
  const auto why = [&](const auto& change) {
    Question question = Sweep();
    change(question);
    return std::string(DecodeQuestion(EncodeQuestion(question), world.scene()).status().message());
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(why([&](Question& q) { q.query.from.x = nan; }), HasSubstr("not finite"));
  EXPECT_THAT(why([&](Question& q) { q.query.to.x = 1e300; }), HasSubstr("beyond limits"));
  EXPECT_THAT(why([&](Question& q) { q.query.to.x = 20'000; }), HasSubstr("too long"));
  EXPECT_THAT(why([&](Question& q) { q.query.at_tick = nan; }), HasSubstr("moment"));
  EXPECT_THAT(why([&](Question& q) { q.query.most_hits = 65; }), HasSubstr("hits"));
  EXPECT_THAT(why([&](Question& q) { q.query.shape = SphereShape{nan}; }), HasSubstr("extent"));
  EXPECT_THAT(why([&](Question& q) { q.kinds = {1000}; }), HasSubstr("an unknown kind"));
  EXPECT_THAT(why([&](Question& q) { q.property = {{"nothing", std::int64_t{1}}}; }), HasSubstr("does not declare"));
  const std::vector<std::uint8_t> bytes = EncodeQuestion(Sweep());
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_FALSE(DecodeQuestion(std::span(bytes).first(size), world.scene()).ok()) << size;
  }
}

TEST(QuestionTest, AnswersAreMergedInOneOrderWhoeverGaveThem) {
  const auto hit = [](std::uint64_t body, double fraction) {
    return QueryHit{.body = BodyId(body), .fraction = fraction, .point = {}, .normal = {0, 1, 0}};
  };
  const Answer one{{hit(5, 0.1), hit(3, 0.5)}, true}, other{{hit(2, 0.5), hit(5, 0.2), hit(9, 0.9)}, false};
  for (const bool turned : {false, true}) {
    Answer all;
    Merge(turned ? other : one, 3, all);
    Merge(turned ? one : other, 3, all);
    std::vector<std::uint64_t> bodies;
    for (const QueryHit& each : all.hits) bodies.push_back(each.body.value());
    EXPECT_THAT(bodies, ElementsAre(5, 2, 3));
    EXPECT_EQ(all.hits.front().fraction, 0.1);
    EXPECT_FALSE(all.complete);
    const auto back = DecodeAnswer(EncodeAnswer(all));
    ASSERT_TRUE(back.ok()) << back.status();
    EXPECT_EQ(EncodeAnswer(*back), EncodeAnswer(all));
  }
}

TEST(QuestionTest, AnAnswerThatIsNotSoundIsRefused) {
  Answer answer{{{.body = BodyId(5), .fraction = 1.5, .point = {}, .normal = {}}}, true};
  EXPECT_FALSE(DecodeAnswer(EncodeAnswer(answer)).ok());
  answer.hits[0].fraction = 0.5;
  EXPECT_TRUE(DecodeAnswer(EncodeAnswer(answer)).ok());
  answer.hits.push_back({.body = BodyId(4), .fraction = 0.25, .point = {}, .normal = {}});
  EXPECT_FALSE(DecodeAnswer(EncodeAnswer(answer)).ok()) << "out of order";
}

class AskTest : public ::testing::Test {
 protected:
  AskTest() { world.AddPlayer(3, "ada"); }
  void Run(std::function<bool(GameCalls&)> on_tick) {
    bool ran = false;
    game.On(kOnCommand, "", [&, on_tick](GameCalls& calls, ScriptedGame::Arguments) {
      ran = true;
      return on_tick(calls);
    });
    if (host == nullptr) {
      module_ = game.module();
      auto loaded = GameHost::Load(module_, {"game.lua", "fine"}, world.shared_scene(), {}, 5);
      ASSERT_TRUE(loaded.ok()) << loaded.status();
      host = *std::move(loaded);
    }
    PlayerRecord& player = world.AddPlayer(3, "ada").player.Change();
    player.commands = {"x"};
    ++player.last_command;
    host->Run(++tick, {}, world);
    EXPECT_TRUE(ran);
  }
  const GameRecord& record() const { return world.record(PlayerBodyId(PlayerNumber(3)).value()); }

  FakeGameWorld world;
  ScriptedGame game;
  std::unique_ptr<GameHost> host;
  Tick tick{100};

 private:
  tessera_game_module module_{};
};

TEST_F(AskTest, AQuestionIsKeptUntilItIsAnswered) {
  int answers = 0;
  game.On(kOnWorldAnswer, "", [&](GameCalls&, ScriptedGame::Arguments arguments) {
    ++answers;
    EXPECT_EQ(arguments.size(), 5u);
    EXPECT_EQ(std::string(arguments[0].as.text, arguments[0].count), "shot");
    EXPECT_EQ(arguments[1].count, 1u);
    EXPECT_EQ(arguments[1].as.list[0].as.fields[0].value.as.id, 9u);
    EXPECT_EQ(arguments[2].as.whole, 0);
    EXPECT_EQ(arguments[4].as.id, PlayerBodyId(PlayerNumber(3)).value());
    return true;
  });
  Run([](GameCalls& calls) {
    EXPECT_TRUE(calls.Call(kWorldAskRay, {std::string("shot"), Vec3d{0, 0, 0}, Vec3d{0, 0, 8}})) << calls.error();
    return true;
  });
  ASSERT_THAT(record().questions, SizeIs(1));
  EXPECT_EQ(record().questions[0].due, tick + 8);
  world.region_answer = Answer{{{.body = BodyId(9), .fraction = 0.5, .point = {}, .normal = {}}}, false};
  for (int i = 0; i < 7; ++i) host->Run(++tick, {}, world);
  EXPECT_EQ(answers, 0);
  const auto answer = std::exchange(world.region_answer, std::nullopt);
  host->Run(++tick, {}, world);
  EXPECT_EQ(answers, 0) << "a region has not answered";
  world.region_answer = answer;
  for (int i = 0; i < 3; ++i) host->Run(++tick, {}, world);
  EXPECT_EQ(answers, 1);
  EXPECT_THAT(record().questions, IsEmpty());
  EXPECT_EQ(record().last_question, 1u);
}

TEST_F(AskTest, QuestionsThatAreWrongAreNamed) {
  std::vector<std::string> errors;
  Run([&](GameCalls& calls) {
    const auto ask = [&](const std::vector<GameValue>& arguments) {
      if (!calls.Call(kWorldAskRay, arguments)) errors.push_back(calls.error());
    };
    ask({std::string(), Vec3d{}, Vec3d{0, 0, 8}});
    ask({std::string(33, 'x'), Vec3d{}, Vec3d{0, 0, 8}});
    ask({std::string("a"), Vec3d{}, Vec3d{}});
    ask({std::string("a"), Vec3d{}, Vec3d{0, 0, 1e5}});
    for (int i = 0; i < 9; ++i) ask({std::string("a"), Vec3d{}, Vec3d{0, 0, 8}});
    return true;
  });
  EXPECT_THAT(errors, ElementsAre("ask_ray: `name` must have 1 to 32 bytes", "ask_ray: `name` must have 1 to 32 bytes",
                                  "ask_ray: `to` is the same point as `from`",
                                  "ask_ray: `to` must be within 10000 m of `from`, got 100000",
                                  "ask_ray: 8 questions wait for their answers already"));
  EXPECT_THAT(record().questions, SizeIs(8));
  ByteWriter out;
  Write(out, record());
  ByteReader in(out.bytes());
  EXPECT_EQ(ReadRecord(in), record());
  EXPECT_TRUE(in.ok() && in.remaining() == 0);
  EXPECT_TRUE(CheckRecord(record()).ok());
}

}  // namespace
}  // namespace tessera::game::question_test
