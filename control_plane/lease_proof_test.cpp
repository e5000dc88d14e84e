// Proofs of the lead, and leases, which alone wait for them.
#include "control_plane/lease_proof.h"

#include <gtest/gtest.h>

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "control_plane/control_plane.h"
#include "control_plane/memory_store.h"
#include "control_plane/secrets.h"
#include "control_plane/testing/lease_request.h"
#include "control_plane/testing/test_plan.h"

namespace tessera::control {
namespace {

// A store whose proofs take until a test answers them, and the leases that are given.
class HeldProofs {
 public:
  bool Prove() {
    std::unique_lock lock(mutex_);
    ++begun_;
    changed_.notify_all();
    changed_.wait(lock, [this] { return !answers_.empty(); });
    const bool answer = answers_.front();
    answers_.pop_front();
    return answer;
  }
  void Give(std::uint64_t number) {
    const std::lock_guard lock(mutex_);
    given_.push_back(number);
    changed_.notify_all();
  }
  // Waits until so many proofs have been begun.
  void AwaitBegun(int count) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return begun_ >= count; });
  }
  void Answer(bool leads) {
    const std::lock_guard lock(mutex_);
    answers_.push_back(leads);
    changed_.notify_all();
  }
  std::uint64_t AwaitGiven() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return !given_.empty(); });
    return std::exchange(given_, {}).front();
  }
  bool HasGiven() {
    const std::lock_guard lock(mutex_);
    return !given_.empty();
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  int begun_ = 0;
  std::deque<bool> answers_;
  std::deque<std::uint64_t> given_;
};

class LeaseProofTest : public ::testing::Test {
 protected:
  HeldProofs held_;
  std::unique_ptr<LeaseProof> proof_ =
      std::make_unique<LeaseProof>([this] { return held_.Prove(); },
                                   [this](const AskedLeases::Asked& asked) { held_.Give(asked.request.number()); });
};

TEST_F(LeaseProofTest, ALeaseIsGivenByAProofThatWasBegunAfterItWasAskedFor) {
  proof_->Ask(1, AskFor(1, 11));
  held_.AwaitBegun(1);
  EXPECT_FALSE(held_.HasGiven());
  proof_->Ask(1, AskFor(1, 12));
  held_.Answer(true);
  EXPECT_EQ(held_.AwaitGiven(), 11U);
  held_.AwaitBegun(2);
  EXPECT_FALSE(held_.HasGiven()) << "the first proof was begun before it was asked for";
  held_.Answer(true);
  EXPECT_EQ(held_.AwaitGiven(), 12U);
}

TEST_F(LeaseProofTest, AFailedProofGivesNothing) {
  proof_->Ask(1, AskFor(1, 11));
  held_.AwaitBegun(1);
  held_.Answer(false);
  proof_->Ask(1, AskFor(2, 22));
  held_.AwaitBegun(2);
  EXPECT_FALSE(held_.HasGiven());
  held_.Answer(true);
  EXPECT_EQ(held_.AwaitGiven(), 22U);
}

TEST_F(LeaseProofTest, ItEndsWhenTheProofUnderWayDoes) {
  proof_->Ask(1, AskFor(1, 11));
  held_.AwaitBegun(1);
  proof_->Ask(1, AskFor(1, 12));
  std::thread end([this] { proof_.reset(); });
  held_.Answer(true);
  end.join();
  EXPECT_EQ(held_.AwaitGiven(), 11U);
}

// A control plane whose proofs are held, and an agent that is to run one worker.
class ProvedLeadTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const Now now{std::chrono::steady_clock::now().time_since_epoch(),
                  std::chrono::system_clock::now().time_since_epoch()};
    auto cluster = Cluster::Load(store_, {}, SystemRandomBytes, now);
    ASSERT_TRUE(cluster.ok()) << cluster.status();
    plane_ = std::make_unique<ControlPlane>(store_, *std::move(cluster), nullptr,
                                            LeaderRights{.proves_lead = [this] { return held_.Prove(); }});
    v1::AgentHello hello;
    hello.set_join_token(AddHost("alpha"));
    Attach(hello);
    const auto made =
        plane_->Call([](Cluster& cluster_now, Now at) { return cluster_now.CreateInstance(at, TestPlan(1), false); });
    ASSERT_TRUE(made.ok()) << made.status();
    std::optional<v1::ControlMessage> message = plane_->NextMessage(*stream_);
    while (message && message->desired().workers_size() == 0) message = plane_->NextMessage(*stream_);
    ASSERT_TRUE(message);
    const v1::WorkerOrder& order = message->desired().workers(0);
    identity_.set_instance_id(order.instance_id());
    identity_.set_region(order.region());
    identity_.set_incarnation(order.incarnation());
  }
  void TearDown() override {
    if (stream_) plane_->Detach(*stream_);
    if (plane_) plane_->Stop();
    plane_.reset();
  }
  void Attach(v1::AgentHello hello) {
    hello.set_advertise_address("127.0.0.1");
    hello.mutable_resources()->set_region_capacity(1);
    auto stream = plane_->Attach(hello, [] {});
    ASSERT_TRUE(stream.ok()) << stream.status();
    stream_ = *std::move(stream);
  }
  // The join token of the new host.
  std::string AddHost(const std::string& name) {
    v1::AddHostRequest request;
    request.set_name(name);
    const auto added = plane_->Call([&](Cluster& cluster, Now now) { return cluster.AddHost(now, request); });
    EXPECT_TRUE(added.ok()) << added.status();
    return added->join_token();
  }
  void Ask(std::uint64_t number) {
    v1::AgentMessage message;
    *message.mutable_lease()->mutable_identity() = identity_;
    message.mutable_lease()->set_number(number);
    EXPECT_TRUE(plane_->HandleAgentMessage(*stream_, message).ok());
  }
  // The number of the next lease that is sent.
  std::uint64_t NextLease() {
    std::optional<v1::ControlMessage> message = plane_->NextMessage(*stream_);
    while (message && !message->has_lease()) message = plane_->NextMessage(*stream_);
    return message ? message->lease().number() : 0;
  }

  HeldProofs held_;
  MemoryStore store_;
  std::unique_ptr<ControlPlane> plane_;
  std::shared_ptr<ControlPlane::AgentStream> stream_;
  v1::WorkerIdentity identity_;
};

TEST_F(ProvedLeadTest, NothingButTheLeaseWaitsForTheProof) {
  Ask(1);
  held_.AwaitBegun(1);
  AddHost("beta");
  v1::AgentMessage heartbeat;
  heartbeat.mutable_heartbeat();
  EXPECT_TRUE(plane_->HandleAgentMessage(*stream_, heartbeat).ok());
  EXPECT_TRUE(plane_->Alive());
  held_.Answer(true);
  EXPECT_EQ(NextLease(), 1U);
}

TEST_F(ProvedLeadTest, ALeaseThatWasAskedForWhileNobodyKnewWhoLeadsIsNotGivenLater) {
  Ask(1);
  held_.AwaitBegun(1);
  held_.Answer(false);
  Ask(2);
  held_.AwaitBegun(2);
  held_.Answer(true);
  EXPECT_EQ(NextLease(), 2U);
}

TEST_F(ProvedLeadTest, AnAgentThatComesBackMeanwhileAsksAgain) {
  Ask(1);
  held_.AwaitBegun(1);
  const v1::Admitted admitted = stream_->admitted;
  plane_->Detach(*std::exchange(stream_, nullptr));
  v1::AgentHello hello;
  hello.set_host_id(admitted.host_id());
  hello.set_host_secret(admitted.host_secret());
  Attach(hello);
  held_.Answer(true);
  Ask(2);
  held_.AwaitBegun(2);
  held_.Answer(true);
  EXPECT_EQ(NextLease(), 2U);
}

}  // namespace
}  // namespace tessera::control
