// One watched world by itself: what of its players' corrections is written into a recording of it.
#include "gateway/watched_world.h"

#include <gmock/gmock.h>

#include <chrono>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "client_sdk/client.h"
#include "client_sdk/testing/fake_instance.h"
#include "host/temporary_folder.h"

namespace tessera::gateway {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

class WatchedWorldTest : public testing::Test {
 protected:
  WatchedWorldTest() : background_(2, [] {}) {
    instance_.regions[0]->started = true;
    services_.control.address = instance_.address;
    const auto channel = DialControl(services_.control);
    EXPECT_TRUE(channel.ok()) << channel.status();
    services_.channel = *channel;
    services_.background = &background_;
    services_.wake = [] {};
    services_.recordings = RecordingFolder(folder_.path(), {});
  }
  bool Until(WatchedWorld& world, const std::function<bool()>& done) {
    const auto limit = std::chrono::steady_clock::now() + 60s;
    while (!done() && std::chrono::steady_clock::now() < limit) {
      instance_.Service();
      background_.Finish();
      world.Tick(now_, true);
    }
    return done();
  }

  const host::TemporaryFolder folder_;
  client::FakeInstance instance_{1};
  Services services_;
  client::TimePoint now_{1h};
  Background background_;  // last: its jobs end before what they refer to
};

TEST_F(WatchedWorldTest, NotesTwentyCorrectionsASecondAndOnlyWhileItIsRecorded) {
  WatchedWorld world(client::FakeInstance::kId, services_);
  world.NoteCorrection(PlayerNumber(3), "before it is joined", now_);
  ASSERT_TRUE(world.SetRecording(true).ok());
  ASSERT_TRUE(Until(world, [&] { return world.recording_state().on; })) << world.recording_state().problem;
  const std::string file = world.recording_state().file;
  now_ += 2s;
  for (int i = 0; i < 30; ++i) world.NoteCorrection(PlayerNumber(3), "0.5 m: correction " + std::to_string(i), now_);
  now_ += 999ms;
  world.NoteCorrection(PlayerNumber(4), "within the same second", now_);
  now_ += 1ms;
  world.NoteCorrection(PlayerNumber(4), "0.1 m: it met body 9", now_);
  world.Tick(now_, true);
  ASSERT_TRUE(world.SetRecording(false).ok());
  world.NoteCorrection(PlayerNumber(4), "after the recording", now_ + 5s);

  auto playing = client::Client::Play(folder_.path() + "/" + file);
  ASSERT_TRUE(playing.ok()) << playing.status();
  (*playing)->Poll(now_);
  (*playing)->Poll(now_ + *(*playing)->length());
  std::vector<std::string> texts;
  for (const std::string& note : (*playing)->TakeNotes()) {
    const json message = json::parse(note);
    ASSERT_EQ(message.at("type"), "events");
    for (const json& event : message.at("events")) {
      EXPECT_FALSE(event.at("time").get<std::string>().empty());
      texts.push_back(event.at("text"));
    }
  }
  std::vector<std::string> expected;
  expected.reserve(21);
  for (int i = 0; i < 20; ++i) {
    expected.push_back("player 3: prediction corrected by 0.5 m: correction " + std::to_string(i));
  }
  expected.push_back("player 4: prediction corrected by 0.1 m: it met body 9");
  EXPECT_EQ(texts, expected);
}

}  // namespace
}  // namespace tessera::gateway
