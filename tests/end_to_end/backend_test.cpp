// A game and its backend on a cluster of real processes: what the game publishes and what the backend sends comes once
// and in order, although workers and the control plane die and the backend loses its connection.
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>

#include <csignal>
#include <fstream>
#include <map>
#include <mutex>
#include <optional>
#include <thread>

#include "core/world/partition_io.h"
#include "host/temporary_folder.h"
#include "local_cluster/connection.h"
#include "tests/end_to_end/world_fixture.h"

namespace tessera::end_to_end {
namespace {

using testing::HasSubstr;

// Two balls in different regions of four, each of which publishes ten times a second.
constexpr char kScene[] = R"(
  name: "counting"
  bounds { min { x: -12 y: -2 z: -12 } max { x: 12 y: 20 z: 12 } }
  properties { name: "count" number: 0 }
  bodies { id: 1 motion: MOTION_STATIC shape { plane { normal { y: 1 } } } }
  bodies {
    id: 2 name: "ball" kind: "ball" mass: 1
    pose { position { x: -6 y: 0.5 z: -6 } }
    shape { sphere { radius: 0.5 } }
  }
  bodies {
    id: 3 name: "ball" kind: "ball" mass: 1
    pose { position { x: 6 y: 0.5 z: 6 } }
    shape { sphere { radius: 0.5 } }
  }
)";
constexpr char kGame[] = R"(
kinds.ball = {
  on_tick = function(self)
    if world.tick() % 6 ~= 0 then return end
    self.count = self.count + 1
    world.publish("count", { count = self.count })
  end,
  on_message = function(self, name, values, sender)
    world.publish("got", { gift = values.gift, sender = sender })
  end,
}
)";

// A game's backend: watches, goes away after some events, and comes back with its cursor.
class Backend {
 public:
  static constexpr std::size_t kEventsAConnection = 25;

  Backend(const std::string& address, std::string id) : address_(address), id_(std::move(id)) {
    thread_ = std::thread([this] { Run(); });
  }
  ~Backend() {
    {
      const std::lock_guard lock(mutex_);
      ending_ = true;
      if (context_) context_->TryCancel();
    }
    thread_.join();
  }

  // The count that each ball has published last.
  std::map<std::uint64_t, std::int64_t> Counts() {
    const std::lock_guard lock(mutex_);
    return counts_;
  }
  std::vector<std::string> Gifts() {
    const std::lock_guard lock(mutex_);
    return gifts_;
  }
  std::string Fault() {
    const std::lock_guard lock(mutex_);
    return fault_;
  }
  std::size_t Connections() {
    const std::lock_guard lock(mutex_);
    return connections_;
  }

 private:
  void Run() {
    const auto stub = v1::InstanceService::NewStub(grpc::CreateChannel(address_, grpc::InsecureChannelCredentials()));
    while (true) {
      grpc::ClientContext context;
      context.set_wait_for_ready(true);
      v1::WatchGameEventsRequest request;
      {
        const std::lock_guard lock(mutex_);
        if (ending_) return;
        context_ = &context;
        request.set_id(id_);
        request.set_after(cursor_);
      }
      const auto reader = stub->WatchGameEvents(&context, request);
      v1::WatchGameEventsResponse response;
      std::size_t count = 0;
      while (count < kEventsAConnection && reader->Read(&response)) {
        ++count;
        Take(response.event());
      }
      context.TryCancel();
      reader->Finish();
      const std::lock_guard lock(mutex_);
      context_ = nullptr;
      ++connections_;
    }
  }
  void Take(const v1::PublishedEvent& event) {
    const std::lock_guard lock(mutex_);
    if (event.number() != cursor_ + 1) fault_ += "not the next number: " + event.ShortDebugString() + "\n";
    cursor_ = event.number();
    if (event.missed() != 0 || event.has_restored()) fault_ += "something is lost: " + event.ShortDebugString() + "\n";
    if (event.name() == "got") {
      gifts_.push_back(event.values(0).text() + " by " + event.values(1).text());
      return;
    }
    std::int64_t& last = counts_[event.body()];
    if (event.values(0).number() != last + 1) {
      fault_ += "after " + std::to_string(last) + ": " + event.ShortDebugString() + "\n";
    }
    last = event.values(0).number();
  }

  const std::string address_, id_;
  std::mutex mutex_;
  grpc::ClientContext* context_ = nullptr;
  bool ending_ = false;
  std::uint64_t cursor_ = 0;
  std::size_t connections_ = 0;
  std::map<std::uint64_t, std::int64_t> counts_;
  std::vector<std::string> gifts_;
  std::string fault_;
  std::thread thread_;
};

class BackendTest : public WorldTest {
 protected:
  void Begin() {
    const std::string scene = Write("counting.textproto", kScene), game = Write("counting.lua", kGame);
    Start({.scene = scene, .game = game, .regions = 4, .bots = 0, .hosts = 2, .capacity = 5});
    backend_ = std::make_unique<Backend>(run_->cluster().control_address(), run_->instance_id());
  }
  std::string Write(const std::string& name, const std::string& text) {
    const std::string path = folder_.path() + "/" + name;
    std::ofstream(path, std::ios::binary) << text;
    return path;
  }
  testing::AssertionResult UntilProtected() {
    return PlayUntil("all regions protected", [this] {
      const v1::Instance instance = run_->Latest();
      return IsSettled() && instance.regions() == 4 && instance.unprotected_regions().empty() &&
             std::ranges::all_of(instance.region_status(),
                                 [](const auto& status) { return status.report().acknowledged_tick() > 60; });
    });
  }
  // Each ball has published so often once more, and the backend knows.
  testing::AssertionResult UntilCounted(std::int64_t more) {
    const auto before = backend_->Counts();
    return PlayUntil("further events of both balls", [&, before] {
      auto now = backend_->Counts();
      auto then = before;
      return !backend_->Fault().empty() || (now[2] >= then[2] + more && now[3] >= then[3] + more);
    });
  }
  // Kills the worker of the region that has this place.
  void KillOwnerOf(Vec3d place) {
    const std::uint32_t failovers = run_->Latest().failovers();
    const std::uint32_t owner = FromProto(run_->Latest().map())->OwnerOf(place).value();
    ASSERT_EQ(kill(static_cast<pid_t>(ReportOf(owner).identity().pid()), SIGKILL), 0);
    ASSERT_TRUE(PlayUntil("the failover", [&] { return run_->Latest().failovers() > failovers; }));
  }
  support::RunResult Send(const std::string& gift, const std::string& request_id) {
    return Tessera(
        {"game", "send", run_->instance_id(), "gift", "gift=" + gift, "--body", "2", "--request-id", request_id});
  }

  host::TemporaryFolder folder_;
  std::unique_ptr<Backend> backend_;
};

TEST_F(BackendTest, WhatIsPublishedAndSentComesOnceThroughDeathsAndLostConnections) {
  Begin();
  ASSERT_TRUE(UntilProtected());
  ASSERT_TRUE(UntilCounted(10));
  for (const Vec3d place : {Vec3d{-6, 0, -6}, Vec3d{6, 0, 6}, Vec3d{0.01, 0, 0.01}, Vec3d{-0.01, 0, -0.01}}) {
    ASSERT_NO_FATAL_FAILURE(KillOwnerOf(place));
    ASSERT_TRUE(UntilCounted(5));
    ASSERT_EQ(backend_->Fault(), "");
    ASSERT_TRUE(UntilProtected());
  }
  const support::RunResult sent = Send("cake", "first");
  EXPECT_EQ(sent.exit_code, 0) << sent.err;
  EXPECT_EQ(Send("cake", "first").exit_code, 0) << "the same request is answered again";

  run_->cluster().KillControl();
  run_->cluster().RestartControl();
  run_->WatchAnew();
  ASSERT_TRUE(PlayUntil("the control plane is back", [this] { return IsSettled(); }));
  EXPECT_EQ(Send("cake", "first").exit_code, 0) << "and by the next control plane";
  const support::RunResult second = Send("tea", "second");
  EXPECT_EQ(second.exit_code, 0) << second.err;
  ASSERT_TRUE(UntilCounted(20));
  ASSERT_TRUE(PlayUntil("both gifts", [this] { return backend_->Gifts().size() >= 2; }));
  EXPECT_EQ(backend_->Fault(), "");
  EXPECT_THAT(backend_->Gifts(), testing::ElementsAre("cake by backend", "tea by backend"));
  EXPECT_GT(backend_->Connections(), 3U);

  EXPECT_THAT(Send("x", "").err, testing::Not(HasSubstr("request_id"))) << "the command line makes one";
  const support::RunResult nobody = Tessera({"game", "send", run_->instance_id(), "gift", "--body", "77"});
  EXPECT_NE(nobody.exit_code, 0);
  EXPECT_THAT(nobody.err, HasSubstr("body: inst-1 has no body 77"));
  const support::RunResult never = Tessera({"game", "watch", run_->instance_id(), "--from", "1000000"});
  EXPECT_NE(never.exit_code, 0);
  EXPECT_THAT(never.err, HasSubstr("after: there is no event 1000000"));
  EXPECT_EQ(Tessera({"instance", "delete", run_->instance_id(), "--wait"}).exit_code, 0);
  const support::RunResult all = Tessera({"game", "watch", run_->instance_id()});
  EXPECT_EQ(all.exit_code, 0) << all.err;
  EXPECT_THAT(all.out, HasSubstr("body 2: got gift=cake sender=backend\n")) << "of one that has ended, and no more";
}

}  // namespace
}  // namespace tessera::end_to_end
