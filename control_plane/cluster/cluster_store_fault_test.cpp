// A store that refuses one write, whichever: what was asked for is done whole or not at all, and can be asked again.
#include <gmock/gmock.h>

#include <functional>

#include "control_plane/testing/cluster_harness.h"

namespace tessera::control {
namespace {

using std::chrono::seconds;

// A world's life: it is made, joined, kept, loses a worker, and is deleted. Whoever is refused asks again when the
// store has been found to work again.
struct FaultedLife {
  FaultedLife() {
    harness.AddHost("alpha", 4);
    harness.AddHost("beta", 4);
  }
  // `done` after a refusal: false, nothing has changed.
  void Ask(const std::function<absl::Status()>& ask, const std::function<bool()>& done) {
    const absl::Status first = ask();
    if (first.ok()) return;
    ++refusals;
    EXPECT_EQ(first.code(), absl::StatusCode::kUnavailable) << first;
    EXPECT_FALSE(done()) << "it was refused";
    harness.Run(seconds(2));
    EXPECT_FALSE(done()) << "it was refused, and is not done later";
    const absl::Status again = ask();
    EXPECT_TRUE(again.ok()) << again;
  }
  std::size_t Worlds() { return ListInstances(harness.cluster().state(), {})->instances_size(); }

  void Create() {
    Ask(
        [this] {
          const auto made = harness.cluster().CreateInstance(harness.now, TestPlan(4), false);
          if (made.ok()) id = made->id();
          return made.status();
        },
        [this] { return Worlds() > 0; });
    harness.Run(seconds(3));
    EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_RUNNING);
    EXPECT_EQ(harness.Workers(), 4U);
  }
  void Join() {
    Ask([this] { return harness.cluster().Join(harness.now, JoinRequest(id)).status(); },
        [this] { return harness.Get(id).player_list_size() > 0; });
    harness.Run(seconds(3));
    EXPECT_EQ(harness.Get(id).player_list_size(), 1);
  }
  // All regions' files come, and the last one of them makes it.
  bool Keep() {
    const auto tick = harness.cluster().BeginCheckpoint(harness.now, id);
    EXPECT_TRUE(tick.ok()) << tick.status();
    harness.Pump();
    std::optional<records::Manifest> whole;
    for (auto& [name, agent] : harness.agents) {
      for (auto& [key, worker] : agent.fake.workers) {
        v1::UploadCheckpointRequest request;
        request.set_host_id(agent.host_id);
        request.set_host_secret(agent.secret);
        *request.mutable_identity() = worker.report.identity();
        request.set_tick(*tick);
        request.set_hash("hash");
        EXPECT_TRUE(harness.cluster().CheckUpload(harness.now, request).ok());
        whole = harness.cluster().NoteUploaded(request);
      }
    }
    EXPECT_TRUE(whole.has_value());
    if (whole) harness.cluster().NoteCheckpoint(harness.now, id, *whole, 1000);
    return harness.Get(id).checkpoints_size() > 0;
  }
  void Checkpoint() {
    if (!Keep()) {
      ++refusals;
      EXPECT_EQ(harness.cluster().WhyNoCheckpoint(id).code(), absl::StatusCode::kUnavailable);
      harness.Run(seconds(6));
      EXPECT_TRUE(Keep());
    }
    EXPECT_EQ(harness.Get(id).checkpoints_size(), 1);
  }
  void Failover() {
    FakeHost& agent = harness.AgentOf(id, 2);
    harness.Send(agent, agent.fake.Kill({id, 2}, 9));
    harness.Run(seconds(20));
    ExpectSettled(harness, id, 4);
    EXPECT_EQ(harness.Get(id).failovers(), 1U);
    EXPECT_EQ(harness.Get(id).lost_bodies(), 0U);
    EXPECT_EQ(harness.Get(id).player_list_size(), 1);
  }
  void Delete() {
    v1::DeleteInstanceRequest request;
    request.set_id(id);
    Ask([&] { return harness.cluster().DeleteInstance(harness.now, request).status(); },
        [this] { return harness.Get(id).state() != v1::INSTANCE_STATE_RUNNING; });
    harness.Run(seconds(15));
    EXPECT_EQ(harness.Get(id).state(), v1::INSTANCE_STATE_ENDED);
    EXPECT_EQ(harness.Workers(), 0U);
  }
  // The store has what the control plane knows.
  void ExpectStored() {
    const v1::Instance known = harness.Get(id);
    harness.Restart();
    harness.Pump();
    const v1::Instance stored = harness.Get(id);
    EXPECT_EQ(stored.state(), known.state());
    EXPECT_EQ(stored.map().version(), known.map().version());
    EXPECT_EQ(stored.player_list_size(), known.player_list_size());
    EXPECT_EQ(stored.checkpoints_size(), known.checkpoints_size());
    EXPECT_EQ(Worlds(), 1U);
  }

  ClusterHarness harness;
  std::string id;
  int refusals = 0;  // that whoever asked saw
};

TEST(StoreFaultInTurnTest, AnyOneWriteMayFail) {
  constexpr int kMostWrites = 400;
  int n = 0, refusals = 0;
  bool failed = true;
  for (; failed && n < kMostWrites && !testing::Test::HasFailure(); ++n) {
    SCOPED_TRACE(n);
    FaultedLife life;
    life.harness.store.FailNext(1, n);
    life.Create();
    life.Join();
    life.Checkpoint();
    life.Failover();
    life.Delete();
    failed = life.harness.store.failures() == 0;
    EXPECT_EQ(life.harness.cluster().state().store_trouble(), "");
    life.harness.store.FailNext(0);
    life.ExpectStored();
    ExpectNoIncarnationTwice(life.harness);
    refusals += life.refusals;
  }
  EXPECT_LT(n, kMostWrites) << "the life has an end";
  EXPECT_GE(n, 10) << "it writes more often than that";
  EXPECT_GE(refusals, 4) << "each of the four that ask was refused once";
}

}  // namespace
}  // namespace tessera::control
