// DeployedWorker: a worker process of a Deployment: a region in its shell that does what its agent's orders say, as
// region_worker has it: it loads, binds, links, runs, keeps its lease, sends its log to its heir and holds copies of
// its wards, halts and goes on by failovers, follows planned maps, and ends.
//
// The region, its shell (worker.h) and what decides are the product's own: Lease, HeirLog, Wards, MapFollower,
// CheckOrder. Only what binds them to sockets and files is made anew here.
//
// Thread rule: one thread at a time.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "region_worker/heir_log.h"
#include "region_worker/link_port.h"
#include "region_worker/map_follower.h"
#include "region_worker/order.h"
#include "region_worker/report.h"
#include "region_worker/wards.h"
#include "tests/simulation/worker.h"

namespace tessera::simulation {

class DeployedWorker;

// What all processes of a deployment share.
struct Surroundings {
  Timeline timeline;
  VirtualNetwork network;
  std::shared_ptr<const Scene> scene;
  region::Settings settings;
  std::map<std::string, Bytes> files;  // of all hosts, by path

  // The checks: a step, a resumption included; those lives are declared dead by a failover that is carried out now.
  std::function<void(DeployedWorker&, const region::StepResult&)> on_step;
  std::function<void(DeployedWorker&, const worker::OrderedFailover&)> on_takeover;
  std::function<void(DeployedWorker&, const std::string&)> on_failure;

  Surroundings(std::uint64_t seed, std::shared_ptr<const Scene> of) : network(timeline, seed), scene(std::move(of)) {}
  // As the product counts time: never near zero.
  std::chrono::steady_clock::time_point Now() const {
    return std::chrono::steady_clock::time_point(std::chrono::hours(1) + std::chrono::microseconds(timeline.now()));
  }
};

class DeployedWorker final : public worker::LinkPort {
 public:
  static constexpr Micros kRound = Milliseconds(10);  // of its loop, when nothing comes

  // `place`: the machine's number. `ended(exit code)` comes last; the caller then destroys this, not at once.
  DeployedWorker(Surroundings& around, worker::Identity identity, std::int64_t pid, v1::RegionAddress address,
                 std::uint32_t place);
  ~DeployedWorker() override;

  // --- Of its agent. `tell` is empty while no agent is there.
  std::function<void(const v1::WorkerMessage&)> tell;
  std::function<void(int code)> ended;
  v1::WorkerMessage FirstWords();  // of an attachment
  void Take(const v1::WorkerOrder& order);
  void TakeLease(const v1::LeaseRenewal& renewal);
  void Stop();  // in order

  const worker::Identity& identity() const { return identity_; }
  std::int64_t pid() const { return pid_; }
  std::uint32_t place() const { return place_; }
  Node node() const { return NodeOf(identity_.region, static_cast<Node>(identity_.incarnation.value())); }
  // Null before the world is built.
  Worker* worker() { return worker_ ? &*worker_ : nullptr; }
  const Worker* worker() const { return worker_ ? &*worker_ : nullptr; }
  bool running() const { return phase_ == v1::WORKER_PHASE_RUNNING; }
  // It steps, as far as it knows: has a lease, is in its map, no failover is under way.
  bool Moves() const;
  bool paused() const { return running() && !lease_.Held(around_.Now()); }
  bool whole() const;  // its heir has a copy, if it has an heir
  const worker::Wards* wards() const { return wards_ ? &*wards_ : nullptr; }
  const worker::Order& order() const { return order_; }
  bool Admits(Node node) const;

  // --- LinkPort.
  net::PeerHandle LinkTo(RegionId region) const override;
  bool SendNow(RegionId to, std::span<const std::uint8_t> message) override;
  void Outrank(RegionId region, Incarnation incarnation) override;
  void SetMapVersion(MapVersion) override {}

 private:
  void Round();
  void Progress();
  void Build();
  absl::StatusOr<region::Config> MakeConfig() const;
  void WireWorker();
  bool MustRebuild() const;
  void Apply();
  absl::Status Resume(const region::Resolution& resolution, std::span<const region::Standby* const> dead);
  void SetPlayers();
  void FollowMaps();
  void Publish(const region::StepResult& result);
  void OnLinkMessage(Node from, std::uint8_t kind, std::span<const std::uint8_t> bytes);
  void Relink();
  void KeepLease();
  void KeepCheckpoint();
  void TellInventory();
  v1::WorkerReport MakeReport() const;
  worker::ReportedState State() const;
  void Report();
  void Fail(const absl::Status& status);
  void End(int code);
  std::optional<v1::InventoryReport> Inventory() const;
  v1::WorkerIdentity Self() const;

  Surroundings& around_;
  worker::Identity identity_;
  std::int64_t pid_;
  v1::RegionAddress address_;
  std::uint32_t place_;
  worker::WorkerMetrics metrics_;
  worker::Lease lease_;
  std::optional<Worker> worker_;
  std::optional<worker::HeirLog> heir_log_;
  std::optional<worker::Wards> wards_;
  std::optional<worker::MapFollower> follower_;
  worker::Order order_;
  v1::WorkerPhase phase_ = v1::WORKER_PHASE_LOADING;
  worker::ReportGate gate_;
  std::set<RegionId> partners_;
  std::map<RegionId, Incarnation> addresses_, outranked_;
  std::set<PlayerNumber> asked_to_spawn_, left_;
  worker::PropertyOrders property_orders_;
  bool stepped_ = false, left_out_ = false, over_ = false;
  std::string failure_;
  std::optional<Tick> saving_;
  Tick checkpoint_tick_;
  std::string checkpoint_failure_;
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
};

}  // namespace tessera::simulation
