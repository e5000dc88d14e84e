// A control plane whose store stands still in a write: who asks is answered.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "control_plane/cluster/queries.h"
#include "control_plane/control_plane.h"
#include "control_plane/doors_fixture.h"
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
    auto cluster = Cluster::Load(timed_, {}, SystemRandomBytes, ControlPlane::ReadClocks());
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

// Whatever is written: who calls is known meanwhile, and a revocation counts once it is answered.
TEST_F(SlowStoreTest, WhoCallsIsKnownWhileAWriteStands) {
  const auto now = [] { return ControlPlane::ReadClocks(); };
  v1::CreateTokenRequest request;
  request.set_name("ada");
  request.set_role(v1::ROLE_VIEWER);
  const auto made = plane_->Call([&](Cluster& cluster, Now at) { return cluster.CreateToken(at, request); });
  ASSERT_TRUE(made.ok()) << made.status();
  const auto known = [&] { return plane_->known_callers()->FindToken(made->secret(), now()) != nullptr; };
  ASSERT_TRUE(known());
  store_.Hold();
  std::thread revocation([this] {
    const absl::Status revoked = plane_->Call([](Cluster& cluster, Now at) {
      v1::RevokeTokenRequest revoke;
      revoke.set_name("ada");
      return cluster.RevokeToken(at, revoke);
    });
    EXPECT_TRUE(revoked.ok()) << revoked;
  });
  store_.AwaitWrite();
  EXPECT_TRUE(known()) << "it has not been answered";
  store_.Release();
  revocation.join();
  EXPECT_FALSE(known());
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

class HeldUpDoorsTest : public DoorsTest {};

TEST_F(HeldUpDoorsTest, ACallIsJudgedWhileTheClusterIsHeldUp) {
  const auto channel = Operators(Token("vic", v1::ROLE_VIEWER));
  ASSERT_TRUE(ListHosts(channel).ok());
  std::promise<void> held, released;
  std::thread holder([&] {
    plane_->Call([&](Cluster&, Now) {
      held.set_value();
      released.get_future().wait();
      return 0;
    });
  });
  held.get_future().wait();
  v1::AddHostRequest request;
  request.set_name("alpha");
  v1::AddHostResponse response;
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(30));
  const grpc::Status status = v1::HostService::NewStub(channel)->AddHost(&context, request, &response);
  released.set_value();
  holder.join();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::PERMISSION_DENIED) << status.error_message();
}

}  // namespace
}  // namespace tessera::control
