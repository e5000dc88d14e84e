// A gateway and the world behind it: what is told of clicked bodies, what is recorded of players, and that who goes,
// in whatever way, leaves the world.
#include <gmock/gmock.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "client_sdk/client.h"
#include "core/world/properties.h"
#include "gateway/testing/gateway_world.h"

namespace tessera::gateway {
namespace {

using client::kBall;
using client::Moving;
using nlohmann::json;
using testing::HasSubstr;

TEST_F(GatewayWorldTest, AClickedBodyAndAPropertyOfAllAreToldOfAsTheyChange) {
  const auto with_health = [&](std::int64_t health) {
    PropertySet set;
    EXPECT_TRUE(set.Set(instance_.scene->properties, "health", health).ok());
    return Bodies{{kBall, Epoch(2), Moving(1, 0), std::make_shared<const replication::Bytes>(set.Encode())}};
  };
  Watcher& viewer = Open();
  Watcher& other = Open();
  ASSERT_TRUE(Until([&] { return viewer.decoder.welcomes == 1 && other.decoder.welcomes == 1; }));
  ASSERT_TRUE(AdvanceUntil(with_health(80), [&] { return viewer.decoder.bodies.contains(kBall.value()); }));
  Send(viewer, {{"type", "select"}, {"body", "1"}});
  Send(viewer, {{"type", "property"}, {"name", "health"}});
  ASSERT_TRUE(Until([&] { return viewer.Newest("detail") != nullptr && viewer.Newest("values") != nullptr; }));
  EXPECT_EQ(viewer.Newest("detail")->at("owner"), 1);
  EXPECT_EQ(viewer.Newest("detail")->at("epoch"), 2);
  EXPECT_EQ(viewer.Newest("detail")->at("properties").at("health"), 80);
  EXPECT_EQ(viewer.Newest("values")->at("values"), (json{{"1", 80}}));
  ASSERT_TRUE(AdvanceUntil(with_health(79), [&] {
    return viewer.Newest("detail")->at("properties").at("health") == 79 &&
           viewer.Newest("values")->at("values") == json{{"1", 79}};
  })) << *viewer.Newest("detail");
  Send(viewer, {{"type", "select"}, {"body", "77"}});
  ASSERT_TRUE(Until([&] { return viewer.Newest("detail")->value("gone", false); }));
  EXPECT_EQ(viewer.Newest("detail")->at("body"), "77");
  EXPECT_EQ(other.Newest("detail"), nullptr) << "it has selected none";
  EXPECT_EQ(other.Newest("values"), nullptr);
}

// Texts of the events in a recording of the gateway.
std::vector<std::string> EventsIn(const std::string& file, client::TimePoint now) {
  auto playing = client::Client::Play(file);
  EXPECT_TRUE(playing.ok()) << playing.status();
  std::vector<std::string> texts;
  if (!playing.ok()) return texts;
  (*playing)->Poll(now);
  (*playing)->Poll(now + *(*playing)->length());
  for (const std::string& note : (*playing)->TakeNotes()) {
    const json message = json::parse(note);
    if (message.at("type") != "events") continue;
    for (const json& event : message.at("events")) texts.push_back(event.at("text"));
  }
  return texts;
}

// The region puts the player half a metre aside now and then, of which its prediction knows nothing.
TEST_F(GatewayWorldTest, ARecordingHasEachCorrectionThatAPlayerIsToldOfWithItsCause) {
  Watcher& player = Open();
  ASSERT_NO_FATAL_FAILURE(JoinAs(player, "ada"));
  std::optional<RecordingState> state;
  const auto record = [&](bool on) {
    gateway_->Record(client::FakeInstance::kId, on, kKey, [&](const absl::StatusOr<RecordingState>& recorded) {
      ASSERT_TRUE(recorded.ok()) << recorded.status();
      state = *recorded;
    });
  };
  ASSERT_TRUE(Until([&] {
    record(true);
    return state && state->on;
  }));
  player.texts.clear();

  const BodyId own(player.decoder.own_body);
  const auto told = [&] {
    std::vector<std::string> texts;
    for (const json& text : player.texts) {
      if (text.at("type") != "corrected") continue;
      EXPECT_EQ(text.at("body"), std::to_string(own.value()));
      texts.push_back(text.at("text"));
    }
    return texts;
  };
  Send(player, {{"type", "steer"}, {"force", {0.1, 0, 0}}});  // by which nobody moves a centimetre in a snapshot
  constexpr int kStepsApart = 30;
  double x = 3;
  for (int step = 1; step < 2000 && told().size() < 3; ++step) {
    if (step % kStepsApart == 0) x = x == 3 ? 3.5 : 3;
    Advance({{own, Epoch(1), Moving(x, 0)}});
  }
  ASSERT_GE(told().size(), 3u);
  record(false);
  EXPECT_FALSE(state->on);
  std::vector<std::string> expected;
  for (const std::string& text : told()) {
    EXPECT_THAT(text, HasSubstr(" m: ")) << "how far, and why";
    expected.push_back("player 1: prediction corrected by " + text);
  }
  EXPECT_EQ(EventsIn(folder_.path() + "/" + state->file, now_), expected);
}

TEST_F(GatewayWorldTest, APlayerWhoseSocketIsGoneLeavesTheWorldAndOthersSeeOn) {
  Watcher& player = Open();
  Watcher& other = Open();
  ASSERT_NO_FATAL_FAILURE(JoinAs(player, "ada"));
  ASSERT_TRUE(Until([&] { return other.decoder.welcomes == 1; }));
  EXPECT_EQ(metrics_.players.Value(), 1);
  Close(player);
  EXPECT_EQ(metrics_.players.Value(), 0);
  EXPECT_TRUE(Until([&] { return instance_.left == 1; }));
  const std::size_t frames = other.decoder.frames;
  EXPECT_TRUE(AdvanceUntil({{kBall, Epoch(1), Moving(1, 0)}}, [&] { return other.decoder.frames >= frames + 10; }));
}

TEST_F(GatewayWorldTest, AViewerThatGoesWhileItJoinsLeavesNoPlayerBehind) {
  Watcher& player = Open();
  ASSERT_TRUE(Until([&] { return player.decoder.welcomes == 1; }));
  Send(player, {{"type", "join"}, {"name", "ada"}});
  EXPECT_EQ(metrics_.players.Value(), 1);
  Close(player);
  EXPECT_TRUE(Until([&] { return instance_.left == 1; })) << "once its join is through";
  EXPECT_EQ(metrics_.players.Value(), 0);
}

TEST_F(GatewayWorldTest, AtTheEndAllPlayersHaveLeftTheWorld) {
  Watcher& ada = Open();
  Watcher& bob = Open();
  Watcher& viewer = Open();
  ASSERT_NO_FATAL_FAILURE(JoinAs(ada, "ada"));
  ASSERT_NO_FATAL_FAILURE(JoinAs(bob, "bob"));
  ASSERT_TRUE(Until([&] { return viewer.decoder.welcomes == 1; }));
  EXPECT_EQ(metrics_.players.Value(), 2);
  gateway_->LeaveAll();
  EXPECT_EQ(instance_.left, 2) << "it is waited for";
  EXPECT_EQ(metrics_.players.Value(), 0);
  // Sockets close after that.
  for (const Watcher* watcher : {&ada, &bob, &viewer}) gateway_->Close(watcher->id);
  EXPECT_EQ(metrics_.players.Value(), 0);
  EXPECT_EQ(metrics_.viewers.Value(), 0);
  EXPECT_EQ(instance_.left, 2);
}

}  // namespace
}  // namespace tessera::gateway
