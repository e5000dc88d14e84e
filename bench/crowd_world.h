// CrowdWorld: a world with its players, as the regions of one instance have it: inputs come in, regions step, snapshots
// are written for every player, and acknowledgements come back late. Everything is in this thread but for the regions'
// own; clients are stubs without sockets, whose time does not count.
//
//   CrowdWorld world(CrowdScene({.players = 400, .bodies = 2000, .radius_m = 30}), map, settings);
//   for (...) world.Tick();
//   world.figures(0).busy_s / world.figures(0).ticks
//
// Thread rule: one thread at a time.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <span>
#include <vector>

#include "bench/acknowledger.h"
#include "bench/lockstep.h"
#include "core/replication/snapshot.h"
#include "region_worker/body_feed.h"

namespace tessera::bench {

// Players and bodies, evenly over a disc, in which all of them mill about.
struct CrowdPlan {
  std::uint32_t players = 0, bodies = 0;
  double radius_m = 0;
  Vec3d centre;
};
Scene CrowdScene(const CrowdPlan& plan);

// Four regions cut so that each has as many of the scene's bodies and players as the others, where balancing would
// bring the cuts of an even grid by and by.
PartitionMap BalancedCrowdMap(const Scene& scene, std::uint32_t regions);

class CrowdWorld {
 public:
  // Since the last Forget; times are CPU time of the calling thread, or by the clock.
  struct Figures {
    std::uint64_t ticks = 0, snapshots = 0;      // snapshots: one for each client
    double busy_s = 0, step_s = 0, write_s = 0;  // all of it; the step of the region; feeding and writing snapshots
    std::uint64_t bytes = 0, bodies = 0, deferred = 0;  // that were sent; records; records that had to wait
  };
  struct ClientFigures {
    std::uint64_t bytes = 0;                // from all regions
    std::uint64_t near = 0, near_came = 0;  // moving bodies within kNear_m at a snapshot's tick; those that it brought
  };
  static constexpr double kNear_m = 10;

  CrowdWorld(std::shared_ptr<const Scene> scene, std::uint32_t players, const PartitionMap& map,
             const region::RegionSettings& settings, bool by_the_clock);
  CrowdWorld(const CrowdWorld&) = delete;
  CrowdWorld& operator=(const CrowdWorld&) = delete;

  void Tick();
  void Forget();

  std::size_t size() const { return sides_.size(); }
  const Figures& figures(std::size_t region) const { return sides_[region].figures; }
  std::span<const ClientFigures> clients() const { return clients_; }
  const ViewRules& view() const { return scene_->view; }
  // Where each player's body is; nothing while no region owns it.
  std::span<const std::optional<Vec3d>> places() const { return places_; }
  std::size_t BodiesOf(std::size_t region) const { return world_->region(region).owned().size(); }

 private:
  // The region's side of one client.
  struct Stub {
    explicit Stub(const replication::SnapshotSettings& settings) : sender(settings) {}
    replication::SnapshotSender sender;
    std::optional<replication::SnapshotReceiver> receiver;  // one in so many has it; the others only acknowledge
    Acknowledger acknowledger;
    std::vector<replication::Bytes> answers;  // under way
  };
  struct Side {
    worker::BodyFeed feed;
    std::unique_ptr<replication::SnapshotHistory> history;
    std::vector<Stub> stubs;
    Figures figures;
  };
  double Now() const;
  void Steer();
  void Locate();
  void Show(std::size_t region);
  void Deliver(std::size_t region, std::uint32_t client, const std::vector<replication::Bytes>& datagrams);

  const std::shared_ptr<const Scene> scene_;
  const replication::SnapshotSettings snapshots_;
  const bool by_the_clock_;
  std::mt19937 random_{1};
  std::unique_ptr<Lockstep> world_;
  std::vector<Side> sides_;
  std::vector<std::optional<Vec3d>> places_;
  std::vector<std::size_t> owners_;  // the region of each player's body, as far as it is known
  std::vector<double> headings_;
  std::vector<ClientFigures> clients_;
  std::uint32_t inputs_ = 0;
};

}  // namespace tessera::bench
