// WorldView: one world out of the snapshots of many regions.
//
// For each body the record with the highest ownership epoch counts, then the latest tick. A body that its owner has
// handed over stays, with its last states, until the next owner sends it: always there, there once. Late records of an
// ownership that has ended are dropped.
//
// Pure: time comes in. Thread rule: one thread at a time.
#pragma once

#include <map>
#include <optional>
#include <unordered_map>
#include <vector>

#include "client_sdk/client.h"
#include "core/replication/snapshot.h"
#include "core/world/limits.h"

namespace tessera::client {

class WorldView {
 public:
  // `snapshot_ticks`: between two snapshots of a region. `max_bodies`: further bodies are ignored.
  // `properties`: as the scene declares them.
  WorldView(double tick_rate_hz, double snapshot_ticks, std::vector<PropertyDef> properties = {},
            std::size_t max_bodies = kMaxBodies + kMaxPlayers);

  void Take(TimePoint now, RegionId from, const replication::ReceivedSnapshot& snapshot,
            std::vector<ClientEvent>& events);
  // `region` begins to send all that it owns: a body that it does not send within kGrace is not there any more.
  // All bodies vanish, and nothing is remembered of those that had left.
  void Clear(std::vector<ClientEvent>& events);
  void RegionBegins(TimePoint now, RegionId region);
  void RegionLost(RegionId region);
  // The map has no such region any more: its bodies stay as they were until another owner sends them, or for
  // kOrphaned.
  void RegionGone(TimePoint now, RegionId region);
  // The client is not connected to it any more because it is too far away: its bodies are out of sight.
  void RegionOutOfSight(RegionId region, std::vector<ClientEvent>& events);
  // Drops bodies whose time to be sent by an owner has run out.
  void Expire(TimePoint now, std::vector<ClientEvent>& events);

  const std::map<BodyId, SeenBody>& bodies() const { return seen_; }
  std::optional<RegionId> OwnerOf(BodyId body) const;
  // At `tick`, in parts of one; `rate_hz` is the world's, for extrapolation. Counts what it extrapolates.
  std::vector<ShownBody> At(double tick, double rate_hz);
  std::uint64_t extrapolations() const { return extrapolations_; }

  // How long a body may be between two owners, or not be sent by a region that has begun anew.
  static constexpr std::chrono::milliseconds kGrace{2000};
  // How long bodies of a region that is gone are shown. Longer than a failover may take.
  static constexpr std::chrono::milliseconds kOrphaned{10'000};

 private:
  struct Sample {
    Tick tick;
    Pose pose;
    Vec3f linear_velocity, angular_velocity;
    bool at_rest = false;
    std::uint8_t jumps = 0;
  };
  struct Track {
    std::size_t count() const { return samples.size() - first; }
    bool empty() const { return count() == 0; }

    SeenBody* seen = nullptr;     // among `seen_`
    std::vector<Sample> samples;  // ascending by tick; from `first` on, never empty
    std::size_t first = 0;        // those before it are over: their room is taken again once it is needed
    std::optional<TimePoint> expires;
  };

  // `known`: its track, if it had one before the snapshot.
  void TakeBody(RegionId from, Tick tick, const replication::BodyRecord& body, Track* known,
                std::vector<ClientEvent>& events);
  void TakeProperties(RegionId from, SeenBody& seen, std::shared_ptr<const replication::Bytes> properties,
                      std::vector<ClientEvent>& events) const;
  void TakeDeparture(TimePoint now, const replication::DepartureRecord& departure, std::vector<ClientEvent>& events);
  void AddSample(Track& track, const Sample& fresh, bool new_owner) const;
  static void MakeRoom(Track& track);
  void Vanish(BodyId body, std::vector<ClientEvent>& events);
  void ExpireAt(Track& track, TimePoint at);
  const std::vector<Track*>& InOrder();
  ShownBody Show(Track& track, double tick, double rate_hz);

  double tick_rate_hz_, snapshot_ticks_;
  std::vector<PropertyDef> properties_;
  std::size_t max_bodies_;
  std::map<BodyId, SeenBody> seen_;
  std::unordered_map<BodyId, Track> tracks_;   // the same bodies as seen_
  std::vector<Track*> taken_;                  // by body of the snapshot that is taken; null: it was not known
  std::vector<Track*> in_order_;               // `tracks_` ascending by id, unless `disordered_`
  bool disordered_ = false;                    // a body came or went since
  TimePoint first_expiry_ = TimePoint::max();  // no track expires before
  std::unordered_map<BodyId, Epoch> removed_;  // bodies that are gone for good, with the last epoch that they had
  std::unordered_map<RegionId, bool> connected_;
  std::uint64_t extrapolations_ = 0;
};

}  // namespace tessera::client
