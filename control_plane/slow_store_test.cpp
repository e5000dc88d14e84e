// A control plane whose store stands still in a write: who asks is answered.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "control_plane/cluster/queries.h"
#include "control_plane/control_plane.h"
#include "control_plane/memory_store.h"
#include "control_plane/secrets.h"
#include "control_plane/timed_store.h"

namespace tessera::control {
namespace {

// Writes stand still while it is held.
class StandingStore final : public Store {
 public:
  absl::StatusOr<StoreEntry> Get(std::string_view key) const override { return store_.Get(key); }
  absl::StatusOr<std::vector<StoreEntry>> ListWithout(std::string_view prefix,
                                                      std::string_view without) const override {
    return store_.ListWithout(prefix, without);
  }
  absl::StatusOr<Revision> Txn(std::span<const StoreOp> ops) override {
    writing = true;
    writing.notify_all();
    held.wait(true);
    writing = false;
    return store_.Txn(ops);
  }
  Revision revision() const override { return store_.revision(); }

  void Hold() {
    writing = false;
    held = true;
  }
  void AwaitWrite() { writing.wait(false); }
  void Release() {
    held = false;
    held.notify_all();
  }

  std::atomic<bool> held{false}, writing{false};

 private:
  MemoryStore store_;
};

class SlowStoreTest : public testing::Test {
 protected:
  SlowStoreTest() {
    const Now now{std::chrono::steady_clock::now().time_since_epoch(),
                  std::chrono::system_clock::now().time_since_epoch()};
    auto cluster = Cluster::Load(timed_, {}, SystemRandomBytes, now);
    EXPECT_TRUE(cluster.ok()) << cluster.status();
    plane_ = std::make_unique<ControlPlane>(store_, *std::move(cluster));
    noting_ = plane_.get();
  }
  ~SlowStoreTest() override {
    noting_ = nullptr;
    plane_->Stop();
  }
  void AddHost(const std::string& name) {
    v1::AddHostRequest request;
    request.set_name(name);
    const auto added = plane_->Call([&](Cluster& cluster, Now now) { return cluster.AddHost(now, request); });
    EXPECT_TRUE(added.ok()) << added.status();
  }
  int Hosts() {
    return plane_->Ask([](const ClusterState& state) { return ListHosts(state, {})->hosts_size(); });
  }

  StandingStore store_;
  std::atomic<ControlPlane*> noting_ = nullptr;
  std::atomic<bool> slow_ = false;
  TimedStore timed_{store_, [](std::chrono::nanoseconds) {},
                    [this](std::chrono::nanoseconds) {
                      ControlPlane* plane = noting_;
                      if (plane != nullptr) plane->NoteWrite(slow_ ? kSlowWrite : std::chrono::nanoseconds(0));
                    }};
  std::unique_ptr<ControlPlane> plane_;
};

TEST_F(SlowStoreTest, QuestionsAreAnsweredAsBeforeTheWriteThatStands) {
  AddHost("alpha");
  slow_ = true;
  store_.Hold();
  std::thread command([this] { AddHost("beta"); });
  store_.AwaitWrite();
  EXPECT_EQ(Hosts(), 1) << "the write stands, and with it whoever changes anything";
  EXPECT_FALSE(plane_->Glance([](const Cluster&) { return 0; }).has_value()) << "metrics show what they showed before";
  EXPECT_EQ(plane_->Trouble(), "");
  store_.Release();
  command.join();
  EXPECT_EQ(Hosts(), 2);
  EXPECT_EQ(plane_->Glance([](const Cluster& c) { return c.state().hosts().size(); }), std::optional<std::size_t>(2));
}

TEST_F(SlowStoreTest, NoPictureOfAnEarlierTimeIsShownOnceWritesAreFast) {
  AddHost("alpha");
  slow_ = true;
  AddHost("beta");  // a picture is kept
  slow_ = false;
  AddHost("gamma");
  store_.Hold();
  std::thread command([this] { AddHost("delta"); });
  store_.AwaitWrite();
  std::thread question([this] { EXPECT_EQ(Hosts(), 4) << "it waits for the write"; });
  store_.Release();
  command.join();
  question.join();
}

}  // namespace
}  // namespace tessera::control
