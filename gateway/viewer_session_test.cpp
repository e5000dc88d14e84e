// One viewer, without a socket: what it is sent, in which order, and that nothing queues.
#include "gateway/viewer_session.h"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "core/world/scene_load.h"
#include "gateway/testing/viewer_decoder.h"
#include "gateway/viewer_format.h"

namespace tessera::gateway {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using testing::ElementsAre;

class ViewerSessionTest : public testing::Test {
 protected:
  ViewerSessionTest() {
    const auto loaded = LoadScene(SceneForm::kText, R"(
      name: "plaza" bounds { min { x: -50 y: -5 z: -50 } max { x: 50 y: 50 z: 50 } }
      bodies { id: 1 motion: MOTION_STATIC shape { plane { normal { y: 1 } } } }
      bodies { id: 2 mass: 1 shape { sphere { radius: 0.5 } } })",
                                  "plaza.textproto");
    EXPECT_TRUE(loaded.ok()) << loaded.status();
    scene_ = loaded->scene;
    identity_.shape = 2;
    view_.book = std::make_shared<SceneBook>(*scene_);
    Begin(1);
    news_.status = R"({"type":"status"})";
    news_.status_number = 1;
    session_.Show(&view_, &news_);
  }
  // The feed of another client.
  void Begin(std::uint64_t generation) {
    view_.generation = generation;
    view_.welcome = EncodeWelcome({.instance = "inst-1"}, *scene_);
    view_.map = EncodeMap(*MakeGridMap(scene_->ground(), 2), {});
    view_.map_number = 1;
    view_.picture = &picture_;
    Move(0);
  }
  void Move(double x) {
    picture_.tick = picture_.tick + 1;
    PictureBody body;
    body.id = BodyId(2);
    body.identity = &identity_;
    body.number = 1;
    body.position = PackPosition({x, 0, 0});
    picture_.bodies = {body};
  }
  // Takes all that the session has now, as the kinds of messages.
  std::vector<std::string> Drain() {
    std::vector<std::string> kinds;
    while (const auto message = session_.Next(now_)) {
      if (message->binary) {
        kinds.push_back(decoder_.Take(message->bytes)["message"]);
        continue;
      }
      texts_.push_back(json::parse(message->bytes.begin(), message->bytes.end()));
      kinds.push_back(texts_.back()["type"]);
    }
    return kinds;
  }
  void Receive(const std::string& text) { asked_ = session_.Receive(text, now_); }

  std::shared_ptr<const Scene> scene_;
  Identity identity_;
  Picture picture_;
  ViewFeed view_;
  NewsFeed news_;
  ViewerSession session_;
  ViewerDecoder decoder_;
  std::vector<json> texts_;
  std::optional<ViewerMessage> asked_;
  ViewerSession::TimePoint now_{1h};
};

TEST_F(ViewerSessionTest, BeginsWithWelcomeShapesStaticsMapAndAFrame) {
  EXPECT_TRUE(session_.Due(now_));
  EXPECT_THAT(Drain(), ElementsAre("welcome", "shapes", "statics", "map", "status", "frame"));
  EXPECT_FALSE(session_.Due(now_));
  EXPECT_EQ(decoder_.bodies.size(), 1u);
}

TEST_F(ViewerSessionTest, ANewStatusGoesOutAtOnceWithoutAWorld) {
  ViewerSession session;
  session.Show(nullptr, &news_);
  const auto message = session.Next(now_);
  ASSERT_TRUE(message.has_value());
  EXPECT_FALSE(message->binary);
  EXPECT_FALSE(session.Next(now_).has_value());
}

TEST_F(ViewerSessionTest, FramesComeAtTheRateThatItAsksFor) {
  Drain();
  const auto frames_in_a_second = [&] {
    const std::uint64_t before = session_.frames();
    for (int i = 0; i < 60; ++i) {
      now_ += 16'667us;
      Move(i);
      Drain();
    }
    return session_.frames() - before;
  };
  EXPECT_NEAR(static_cast<double>(frames_in_a_second()), 30, 1);
  Receive(R"({"type":"view","rate_hz":60})");
  EXPECT_NEAR(static_cast<double>(frames_in_a_second()), 60, 1);
  Receive(R"({"type":"view","rate_hz":5})");
  EXPECT_NEAR(static_cast<double>(frames_in_a_second()), 5, 1);
}

TEST_F(ViewerSessionTest, AHigherRateHoldsAtOnce) {
  Receive(R"({"type":"view","rate_hz":1})");
  Drain();
  now_ += 100ms;
  Receive(R"({"type":"view","rate_hz":30})");
  const std::uint64_t before = session_.frames();
  for (int tick = 0; tick < 30; ++tick) {
    now_ += 16'667us;
    Move(tick);
    Drain();
  }
  EXPECT_NEAR(static_cast<double>(session_.frames() - before), 15, 1);
}

TEST_F(ViewerSessionTest, ALoopThatTicksALittleUnpunctuallyCostsNoFrame) {
  Drain();
  const std::uint64_t before = session_.frames();
  const ViewerSession::TimePoint begin = now_;
  constexpr std::chrono::microseconds kLate[] = {900us, 50us, 400us, 1300us, 0us, 700us, 200us};
  for (int tick = 1; tick <= 600; ++tick) {
    now_ = begin + tick * 16'666'666ns + kLate[tick % std::size(kLate)];
    Move(tick);
    Drain();
  }
  EXPECT_NEAR(static_cast<double>(session_.frames() - before), 300, 3);
}

TEST_F(ViewerSessionTest, WhoReadsSlowlyGetsTheNewestFrameOnce) {
  Drain();
  for (int i = 0; i < 1000; ++i) {
    now_ += 17ms;
    Move(i * 0.25);
    view_.met.Add(R"({"type":"met"})", kMaxMetKept);
    news_.status_number = static_cast<std::uint64_t>(i) + 2;
  }
  const std::vector<std::string> kinds = Drain();
  EXPECT_EQ(std::count(kinds.begin(), kinds.end(), "frame"), 1);
  EXPECT_EQ(std::count(kinds.begin(), kinds.end(), "status"), 1);
  EXPECT_LE(std::count(kinds.begin(), kinds.end(), "met"), 100);
  EXPECT_EQ(decoder_.bodies.at(2).Metres().x, 999 * 0.25);
}

TEST_F(ViewerSessionTest, BytesASecondKeepToTheLowerBudget) {
  session_.LimitBytes(40'000);
  double x = 0;
  const auto bytes_in_ten_seconds = [&] {
    std::size_t bytes = 0;
    for (const auto until = now_ + 10s; now_ < until; now_ += 16'667us) {
      Move(x += 0.25);
      for (std::uint64_t id = 3; id < 500; ++id) {
        picture_.bodies.push_back(picture_.bodies.front());
        picture_.bodies.back().id = BodyId(id);
      }
      while (const auto message = session_.Next(now_)) {
        const bool frame = message->binary && message->bytes[0] == static_cast<std::uint8_t>(MessageKind::kFrame);
        if (frame) bytes += message->bytes.size();
      }
    }
    return bytes;
  };
  const auto near = [](double bytes) { return testing::AllOf(testing::Gt(bytes * 0.95), testing::Lt(bytes * 1.03)); };
  EXPECT_THAT(static_cast<double>(bytes_in_ten_seconds()), near(400'000));
  EXPECT_GT(session_.last_frame().deferred, 0u);
  Receive(R"({"type":"view","kbytes_per_s":20})");
  EXPECT_THAT(static_cast<double>(bytes_in_ten_seconds()), near(200'000));
  Receive(R"({"type":"view","kbytes_per_s":1000})");
  EXPECT_THAT(static_cast<double>(bytes_in_ten_seconds()), near(400'000)) << "the gateway's limit holds";
  session_.LimitBytes(10e6);
  bytes_in_ten_seconds();
  EXPECT_EQ(session_.last_frame().deferred, 0u);
}

TEST_F(ViewerSessionTest, ValuesWaitWhileTheBudgetIsSpent) {
  PropertyValues values;
  for (std::uint64_t id = 10; id < 5010; ++id) values[BodyId(id)] = "0";
  view_.values = [&](const std::string&, ViewerSession::TimePoint) -> const PropertyValues& { return values; };
  session_.LimitBytes(8'000);
  Drain();
  Receive(R"({"type":"property","name":"health"})");
  const auto count = [&] {
    const auto kinds = Drain();
    return std::count(kinds.begin(), kinds.end(), "values");
  };
  EXPECT_EQ(count(), 1) << "the first thousand";
  now_ += 250ms;
  EXPECT_EQ(count(), 0);
  std::int64_t later = 0;
  for (int i = 0; i < 40; ++i) {
    now_ += 250ms;
    later += count();
  }
  EXPECT_EQ(later, 4);
}

TEST_F(ViewerSessionTest, AWorldThatStandsStillIsShownNowAndThen) {
  picture_.paused = true;
  Drain();
  const std::uint64_t before = session_.frames();
  for (int i = 0; i < 120; ++i) {
    now_ += 16'667us;
    Drain();
  }
  EXPECT_NEAR(static_cast<double>(session_.frames() - before), 4, 1);
  Receive(R"({"type":"view","center":[0,0,0],"radius_m":10})");
  EXPECT_TRUE(session_.Due(now_)) << "but another view at once";
}

TEST_F(ViewerSessionTest, AnotherClientBeginsAnewWithAWelcome) {
  Drain();
  Begin(2);
  EXPECT_THAT(Drain(), ElementsAre("welcome", "shapes", "statics", "map", "frame"));
  EXPECT_EQ(decoder_.bodies.size(), 1u);
  EXPECT_EQ(decoder_.welcomes, 2u);
}

TEST_F(ViewerSessionTest, AMapThatChangesIsSentAgain) {
  Drain();
  ++view_.map_number;
  EXPECT_THAT(Drain(), ElementsAre("map"));
}

TEST_F(ViewerSessionTest, EventsAreSentOnceAndTheFirstHoldsWhatWasKept) {
  for (const char* text : {"a", "b"}) {
    v1::InstanceEvent event;
    event.set_text(text);
    news_.events.Add(event, kMaxEventsKept);
  }
  Drain();
  ASSERT_EQ(texts_.back()["events"].size(), 2u);
  v1::InstanceEvent event;
  event.set_text("c");
  news_.events.Add(event, kMaxEventsKept);
  Drain();
  ASSERT_EQ(texts_.back()["events"].size(), 1u);
  EXPECT_EQ(texts_.back()["events"][0]["text"], "c");
}

TEST_F(ViewerSessionTest, TheDetailOfASelectedBodyComesWhileItChanges) {
  int asked = 0;
  std::string detail = R"({"type":"detail","body":"2"})";
  view_.detail = [&](BodyId body) {
    ++asked;
    EXPECT_EQ(body, BodyId(2));
    return detail;
  };
  Drain();
  EXPECT_EQ(asked, 0);
  Receive(R"({"type":"select","body":"2"})");
  EXPECT_THAT(Drain(), ElementsAre("detail"));
  now_ += 10ms;
  EXPECT_EQ(asked, 1) << "ten times a second";
  now_ += 10s;
  picture_.paused = true;
  Drain();
  EXPECT_EQ(asked, 2);
  EXPECT_EQ(texts_.size(), 2u) << "it has not changed";
}

TEST_F(ViewerSessionTest, ValuesOfAPropertyAreSentAsTheyChange) {
  PropertyValues values{{BodyId(2), "80"}, {BodyId(3), "true"}};
  view_.values = [&](const std::string& property, ViewerSession::TimePoint) -> const PropertyValues& {
    EXPECT_EQ(property, "health");
    return values;
  };
  Drain();
  const auto sent = [&] {
    texts_.clear();
    now_ += 250ms;
    Drain();
    json all = json::object();
    for (const json& text : texts_) {
      if (text["type"] == "values") all.update(text["values"]);
    }
    return all;
  };
  EXPECT_EQ(sent(), json::object()) << "nobody asked";
  Receive(R"({"type":"property","name":"health"})");
  EXPECT_FALSE(asked_.has_value()) << "the session does it itself";
  EXPECT_EQ(sent(), (json{{"2", 80}, {"3", true}}));
  EXPECT_EQ(sent(), json::object()) << "nothing has changed";
  values[BodyId(2)] = "79";
  values.erase(BodyId(3));
  EXPECT_EQ(sent(), (json{{"2", 79}}));
  values[BodyId(3)] = "true";
  EXPECT_EQ(sent(), (json{{"3", true}})) << "it is another one, that came back";
  Begin(2);
  EXPECT_EQ(sent(), (json{{"2", 79}, {"3", true}})) << "the picture begins anew";
  Receive(R"({"type":"property"})");
  values[BodyId(2)] = "1";
  EXPECT_EQ(sent(), json::object());
  // Thousands come in several messages.
  for (std::uint64_t id = 10; id < 2510; ++id) values[BodyId(id)] = "0";
  Receive(R"({"type":"property","name":"health"})");
  EXPECT_EQ(sent().size(), 2502u);
  EXPECT_GT(texts_.size(), 2u);
}

TEST_F(ViewerSessionTest, PropertiesOfTheWorldAreSentFirstAndAsTheyChange) {
  Drain();
  for (const json& text : texts_) EXPECT_NE(text["type"], "world") << "it has none";
  const auto sent = [&] {
    texts_.clear();
    Drain();
    std::vector<int> reds;
    for (const json& text : texts_) {
      if (text["type"] == "world") reds.push_back(text["properties"]["red"]);
    }
    return reds;
  };
  const auto score = [&](int red) {
    view_.world = json({{"type", "world"}, {"properties", {{"red", red}}}}).dump();
    ++view_.world_number;
  };
  score(1);
  EXPECT_TRUE(session_.Due(now_));
  EXPECT_THAT(sent(), ElementsAre(1));
  std::vector<int> all;
  for (int i = 2; i <= 70; ++i) {
    now_ += 16'667us;
    if (i <= 61) score(i);
    for (const int red : sent()) all.push_back(red);
  }
  EXPECT_NEAR(static_cast<double>(all.size()), 11, 1) << "ten a second";
  EXPECT_EQ(all.back(), 61);
  now_ += 1s;
  EXPECT_THAT(sent(), ElementsAre()) << "nothing has changed";
  Begin(2);
  EXPECT_THAT(sent(), ElementsAre(61)) << "the picture begins anew";
  session_.LimitBytes(100);
  now_ += 100ms;
  score(62);
  EXPECT_THAT(sent(), ElementsAre(62));
  now_ += 100ms;
  score(63);
  EXPECT_THAT(sent(), ElementsAre()) << "the budget is overdrawn";
  now_ += 10s;
  EXPECT_THAT(sent(), ElementsAre(63));
}

TEST_F(ViewerSessionTest, WhatIsForTheGatewayIsHandedOn) {
  Receive(R"({"type":"join","name":"ada"})");
  ASSERT_TRUE(asked_ && std::holds_alternative<JoinWorld>(*asked_));
  Receive(R"({"type":"view"})");
  EXPECT_FALSE(asked_.has_value());
}

TEST_F(ViewerSessionTest, ABadMessageIsAnsweredAndTheTenthIsTheEnd) {
  Drain();
  for (int i = 1; i <= 10; ++i) {
    EXPECT_FALSE(session_.over());
    Receive("nonsense");
    Drain();
    EXPECT_EQ(texts_.back()["code"], "bad_message");
  }
  EXPECT_TRUE(session_.over());
  EXPECT_EQ(session_.close_code(), "bad_message");
  EXPECT_FALSE(session_.Next(now_).has_value());
  EXPECT_FALSE(session_.Due(now_));
}

TEST_F(ViewerSessionTest, AFloodIsCutOffWithinItsBudget) {
  Drain();
  for (int i = 0; i < 100'000; ++i) Receive(R"({"type":"steer"})");
  Drain();
  EXPECT_TRUE(session_.over());
}

TEST_F(ViewerSessionTest, AnswersOfOneWhoDoesNotReadAreBounded) {
  Drain();
  for (std::uint64_t i = 0; i < 65; ++i) session_.Answer(i, absl::OkStatus(), "done");
  const std::vector<std::string> kinds = Drain();
  EXPECT_EQ(kinds.front(), "problem");
  EXPECT_TRUE(session_.over());
}

TEST_F(ViewerSessionTest, AFinalProblemIsTheLastMessage) {
  session_.Report({.code = "no_world", .text = "instance inst-9: no such instance"}, true);
  EXPECT_THAT(Drain(), ElementsAre("problem"));
  EXPECT_EQ(session_.close_code(), "no_world");
}

}  // namespace
}  // namespace tessera::gateway
