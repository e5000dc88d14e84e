// GatewayWorldTest: a gateway without sockets, at an instance whose world the test moves by hand, and viewers that take
// all that they are sent. Time is the test's own: it stands while datagrams are on their way.
//
//   Watcher& viewer = Open();
//   ASSERT_TRUE(Until([&] { return viewer.decoder.welcomes == 1; }));
//   Send(viewer, {{"type", "select"}, {"body", "1"}});
//   ASSERT_TRUE(AdvanceUntil(bodies, [&] { return viewer.Newest("detail") != nullptr; }));
//
// Thread rule: one thread.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "client_sdk/client_fixture.h"
#include "client_sdk/testing/fake_instance.h"
#include "gateway/gateway.h"
#include "gateway/instance_feed.h"
#include "gateway/testing/viewer_decoder.h"
#include "host/temporary_folder.h"

namespace tessera::gateway {

struct Watcher {
  ViewerId id = 0;
  ViewerDecoder decoder{};
  std::vector<nlohmann::json> texts{};

  // Null: none of that type came.
  const nlohmann::json* Newest(const std::string& type) const {
    const auto found =
        std::find_if(texts.rbegin(), texts.rend(), [&](const auto& text) { return text["type"] == type; });
    return found == texts.rend() ? nullptr : &*found;
  }
};

class GatewayWorldTest : public testing::Test {
 protected:
  using Bodies = std::vector<replication::BodyRecord>;
  static constexpr char kKey[] = "key";

  GatewayWorldTest() {
    instance_.regions[0]->started = true;
    GatewayOptions options;
    options.control.address = instance_.address;
    options.key = kKey;
    options.recordings_dir = folder_.path();
    const auto channel = DialControl(options.control);
    EXPECT_TRUE(channel.ok()) << channel.status();
    gateway_ = std::make_unique<Gateway>(options, *channel, metrics_, [] {});
  }

  Watcher& Open() {
    const ViewerId id = gateway_->Open(client::FakeInstance::kId);
    Watcher& watcher = watchers_[id];
    watcher.id = id;
    return watcher;
  }
  void Close(const Watcher& watcher) {
    gateway_->Close(watcher.id);
    watchers_.erase(watcher.id);
  }
  void Send(const Watcher& watcher, const nlohmann::json& message) {
    gateway_->Receive(watcher.id, message.dump(), now_);
  }
  // It plays from now on; its body.
  void JoinAs(Watcher& watcher, const std::string& name) {
    ASSERT_TRUE(Until([&] { return watcher.decoder.welcomes == 1; }));
    Send(watcher, {{"type", "join"}, {"name", name}});
    ASSERT_TRUE(Until([&] { return watcher.decoder.own_body != 0; })) << name;
  }

  void PollOnce() {
    instance_.Service();
    for (const ViewerId due : gateway_->Tick(now_)) {
      Watcher& watcher = watchers_.at(due);
      while (const auto message = gateway_->Next(due, now_)) {
        if (message->binary) {
          watcher.decoder.Take(message->bytes);
        } else {
          watcher.texts.push_back(nlohmann::json::parse(message->bytes.begin(), message->bytes.end()));
        }
      }
    }
  }
  // The test's clock stands; false when time is up.
  bool Until(const std::function<bool()>& done) {
    const auto limit = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (!done() && std::chrono::steady_clock::now() < limit) PollOnce();
    return done();
  }
  // Two ticks on, after which the region has these bodies.
  void Advance(const Bodies& bodies) {
    constexpr int kPolls = 5;  // datagrams of this machine to itself are there at once
    tick_ = tick_ + 2;
    now_ += 2 * client::kTick;
    instance_.regions[0]->Snapshot(tick_, bodies);
    for (int poll = 0; poll < kPolls; ++poll) PollOnce();
  }
  // False when it has not become so in a minute of the test's time.
  bool AdvanceUntil(const Bodies& bodies, const std::function<bool()>& done) {
    for (int step = 0; step < 1800 && !done(); ++step) Advance(bodies);
    return done();
  }

  const host::TemporaryFolder folder_;
  client::FakeInstance instance_{1, "gravity { y: 0 } "};  // so that who stands is where a prediction has it
  GatewayMetrics metrics_;
  client::TimePoint now_{std::chrono::hours(1)};
  Tick tick_;
  std::map<ViewerId, Watcher> watchers_;
  std::unique_ptr<Gateway> gateway_;  // last: it ends before what it speaks to
};

}  // namespace tessera::gateway
