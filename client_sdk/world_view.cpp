#include "client_sdk/world_view.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "client_sdk/blend.h"
#include "core/world/prefetch.h"

namespace tessera::client {
namespace {

// States of a body that are kept for showing: over a second at 30 a second.
constexpr std::size_t kMaxSamples = 40;

// Bytes that nobody can have set say nothing.
PropertySet SetFrom(const std::shared_ptr<const replication::Bytes>& bytes, std::span<const PropertyDef> defs) {
  if (bytes == nullptr || bytes->empty()) return {};
  return PropertySet::Decode(*bytes, defs).value_or(PropertySet());
}

double AsDouble(Tick tick) { return static_cast<double>(tick.value()); }

Pose Ahead(const Pose& pose, Vec3f linear_velocity, Vec3f angular_velocity, double seconds) {
  const Vec3d turn = Vec3d(angular_velocity) * seconds;
  const double angle = Length(turn);
  Quatd rotation;
  if (angle > 0) {
    const Vec3d axis = turn * (std::sin(angle / 2) / angle);
    rotation = {axis.x, axis.y, axis.z, std::cos(angle / 2)};
  }
  return {pose.position + Vec3d(linear_velocity) * seconds, Normalized(rotation * pose.orientation)};
}

}  // namespace

WorldView::WorldView(double tick_rate_hz, double snapshot_ticks, std::vector<PropertyDef> properties,
                     std::size_t max_bodies)
    : tick_rate_hz_(tick_rate_hz),
      snapshot_ticks_(snapshot_ticks),
      properties_(std::move(properties)),
      max_bodies_(max_bodies) {}

void WorldView::Take(TimePoint now, RegionId from, const replication::ReceivedSnapshot& snapshot,
                     std::vector<ClientEvent>& events) {
  // All are looked up first, so that this waits for memory in many places at once, and then asked for ahead.
  taken_.clear();
  for (const replication::BodyRecord& body : snapshot.bodies) {
    const auto known = tracks_.find(body.id);
    taken_.push_back(known != tracks_.end() ? &known->second : nullptr);
  }
  constexpr std::size_t kAhead = 4;
  for (std::size_t i = 0; i < taken_.size(); ++i) {
    if (const Track* later = i + kAhead < taken_.size() ? taken_[i + kAhead] : nullptr; later != nullptr) {
      Prefetch(later->seen, sizeof(SeenBody));
      Prefetch(&later->samples.back(), 2 * sizeof(Sample));
    }
    TakeBody(from, snapshot.tick, snapshot.bodies[i], taken_[i], events);
  }
  for (const replication::DepartureRecord& departure : snapshot.departures) TakeDeparture(now, departure, events);
}

void WorldView::TakeBody(RegionId from, Tick tick, const replication::BodyRecord& body, Track* known,
                         std::vector<ClientEvent>& events) {
  const auto removed = removed_.find(body.id);
  if (removed != removed_.end()) {
    if (body.epoch <= removed->second) return;
    removed_.erase(removed);
  }
  bool fresh = false;
  if (known == nullptr) {
    if (tracks_.size() >= max_bodies_ && !tracks_.contains(body.id)) return;
    const auto [at, is_new] = tracks_.try_emplace(body.id);
    known = &at->second;
    fresh = is_new;
  }
  Track& track = *known;
  if (fresh) {
    track.seen = &seen_.emplace(body.id, SeenBody{body.id, from, body.epoch, tick, body.state}).first->second;
    disordered_ = true;
  }
  SeenBody& seen = *track.seen;
  if (!fresh && body.epoch < seen.epoch) return;
  const bool new_owner = !fresh && body.epoch > seen.epoch;
  const BodyState& state = body.state;
  AddSample(track,
            {tick,
             {state.position, state.orientation},
             state.linear_velocity,
             state.angular_velocity,
             AtRest(state),
             body.traits.jumps},
            new_owner);
  track.expires.reset();
  if (fresh || new_owner || tick > seen.tick) {
    seen.region = from;
    seen.epoch = body.epoch;
    seen.tick = tick;
    seen.state = state;
    seen.jumps = body.traits.jumps;
    seen.tuning = body.traits.tuning;
  }
  if (fresh) {
    seen.properties = body.properties;
    events.push_back({.kind = ClientEvent::Kind::kAppeared, .body = body.id, .region = from});
  } else if (body.properties != nullptr || new_owner) {
    // The first record of an ownership has all properties; later ones have them where they are new.
    TakeProperties(from, seen, body.properties, events);
  }
}

void WorldView::TakeProperties(RegionId from, SeenBody& seen, std::shared_ptr<const replication::Bytes> properties,
                               std::vector<ClientEvent>& events) const {
  const auto before = std::exchange(seen.properties, std::move(properties));
  if (before == seen.properties) return;
  const PropertySet was = SetFrom(before, properties_), is = SetFrom(seen.properties, properties_);
  for (const std::string_view name : ChangedProperties(properties_, was, is)) {
    events.push_back(
        {.kind = ClientEvent::Kind::kPropertyChanged, .body = seen.id, .region = from, .property = std::string(name)});
  }
}

// Before one more is added at the end. Half of them have to be over, so that not each one moves all others.
void WorldView::MakeRoom(Track& track) {
  if (track.samples.size() < track.samples.capacity() || 2 * track.first < track.samples.size()) return;
  track.samples.erase(track.samples.begin(), track.samples.begin() + static_cast<std::ptrdiff_t>(track.first));
  track.first = 0;
}

void WorldView::AddSample(Track& track, const Sample& fresh, bool new_owner) const {
  const Tick tick = fresh.tick;
  std::vector<Sample>& samples = track.samples;
  // States of an earlier owner from the new one's time do not count.
  while (new_owner && !track.empty() && samples.back().tick >= tick) samples.pop_back();
  MakeRoom(track);
  if (!track.empty() && samples.back().tick >= tick) {
    const auto at = std::lower_bound(samples.begin() + static_cast<std::ptrdiff_t>(track.first), samples.end(), tick,
                                     [](const Sample& sample, Tick t) { return sample.tick < t; });
    if (at->tick != tick) samples.insert(at, fresh);
    return;
  }
  // A body at rest is not sent, so it stood until the snapshot before this one: it must not glide through its rest.
  const auto interval = static_cast<std::uint64_t>(std::ceil(snapshot_ticks_));
  if (!track.empty() && samples.back().at_rest && samples.back().tick + interval < tick) {
    Sample stood = samples.back();
    stood.tick = Tick(tick.value() - interval);
    samples.push_back(stood);
  }
  samples.push_back(fresh);
  if (track.count() > kMaxSamples) track.first = samples.size() - kMaxSamples;
}

void WorldView::TakeDeparture(TimePoint now, const replication::DepartureRecord& departure,
                              std::vector<ClientEvent>& events) {
  const auto found = tracks_.find(departure.id);
  if (departure.why == replication::DepartureRecord::Why::kOutOfInterest) {
    // It is there still, and may come back as it is.
    if (found != tracks_.end() && found->second.seen->epoch <= departure.epoch) Vanish(departure.id, events);
    return;
  }
  if (departure.to == RegionId()) {
    Epoch& last = removed_[departure.id];
    last = std::max(last, departure.epoch);
    if (found != tracks_.end() && found->second.seen->epoch <= departure.epoch) Vanish(departure.id, events);
    return;
  }
  if (found == tracks_.end() || found->second.seen->epoch > departure.epoch)
    return;  // the next owner has sent it already
  found->second.seen->region = departure.to;
  const auto connection = connected_.find(departure.to);
  if (connection == connected_.end()) {  // it may be too far away to be connected to, or about to be connected
    ExpireAt(found->second, now + kOrphaned);
  } else if (connection->second) {  // a lost region cannot send it, so it stays
    ExpireAt(found->second, now + kGrace);
  }
}

void WorldView::Clear(std::vector<ClientEvent>& events) {
  while (!seen_.empty()) Vanish(seen_.begin()->first, events);
  removed_.clear();
  connected_.clear();
}

void WorldView::RegionBegins(TimePoint now, RegionId region) {
  connected_[region] = true;
  for (auto& [id, track] : tracks_) {
    if (track.seen->region == region) ExpireAt(track, now + kGrace);
  }
}

void WorldView::RegionLost(RegionId region) {
  connected_[region] = false;
  for (auto& [id, track] : tracks_) {
    if (track.seen->region == region) track.expires.reset();
  }
}

void WorldView::RegionGone(TimePoint now, RegionId region) {
  connected_.erase(region);
  for (auto& [id, track] : tracks_) {
    if (track.seen->region == region) ExpireAt(track, now + kOrphaned);
  }
}

void WorldView::RegionOutOfSight(RegionId region, std::vector<ClientEvent>& events) {
  connected_.erase(region);
  std::vector<BodyId> gone;
  for (const auto& [id, body] : seen_) {
    if (body.region == region) gone.push_back(id);
  }
  for (const BodyId id : gone) Vanish(id, events);
}

void WorldView::ExpireAt(Track& track, TimePoint at) {
  track.expires = at;
  first_expiry_ = std::min(first_expiry_, at);
}

void WorldView::Expire(TimePoint now, std::vector<ClientEvent>& events) {
  if (now < first_expiry_) return;
  first_expiry_ = TimePoint::max();
  std::vector<BodyId> gone;
  for (const Track* track : InOrder()) {
    if (!track->expires.has_value()) continue;
    if (*track->expires <= now) {
      gone.push_back(track->seen->id);
    } else {
      first_expiry_ = std::min(first_expiry_, *track->expires);
    }
  }
  for (const BodyId id : gone) Vanish(id, events);
}

void WorldView::Vanish(BodyId body, std::vector<ClientEvent>& events) {
  events.push_back({.kind = ClientEvent::Kind::kVanished, .body = body, .region = seen_.at(body).region});
  seen_.erase(body);
  tracks_.erase(body);
  disordered_ = true;
}

const std::vector<WorldView::Track*>& WorldView::InOrder() {
  if (!disordered_) return in_order_;
  in_order_.clear();
  in_order_.reserve(seen_.size());
  for (const auto& [id, body] : seen_) in_order_.push_back(&tracks_.at(id));
  disordered_ = false;
  return in_order_;
}

std::optional<RegionId> WorldView::OwnerOf(BodyId body) const {
  const auto found = seen_.find(body);
  if (found == seen_.end()) return std::nullopt;
  return found->second.region;
}

std::vector<ShownBody> WorldView::At(double tick, double rate_hz) {
  std::vector<ShownBody> shown;
  shown.reserve(tracks_.size());
  const std::vector<Track*>& order = InOrder();
  // Tracks lie anywhere, and a frame is long enough for the caches to forget them.
  constexpr std::size_t kAhead = 6;
  for (std::size_t i = 0; i < order.size(); ++i) {
    if (i + 2 * kAhead < order.size()) Prefetch(order[i + 2 * kAhead], sizeof(Track));
    if (i + kAhead < order.size()) {
      const Track& later = *order[i + kAhead];
      Prefetch(later.seen, sizeof(SeenBody));
      Prefetch(later.samples.data() + later.first, 3 * sizeof(Sample));
    }
    shown.push_back(Show(*order[i], tick, rate_hz));
  }
  return shown;
}

ShownBody WorldView::Show(Track& track, double tick, double rate_hz) {
  const BodyId id = track.seen->id;
  const std::vector<Sample>& samples = track.samples;
  while (track.first + 1 < samples.size() && AsDouble(samples[track.first + 1].tick) <= tick) ++track.first;
  const Sample& before = samples[track.first];
  const double past = tick - AsDouble(before.tick);
  const auto shown = [&](const Pose& pose, bool extrapolated) {
    return ShownBody{.id = id, .pose = pose, .extrapolated = extrapolated, .seen = track.seen};
  };
  if (past <= 0 || (track.count() == 1 && before.at_rest)) return shown(before.pose, false);
  if (track.count() > 1) {
    const Sample& after = samples[track.first + 1];
    // It was put elsewhere: it is not shown on a way that it did not go.
    if (after.jumps != before.jumps) return shown(before.pose, false);
    const double share = past / AsDouble(Tick(static_cast<std::uint64_t>(after.tick - before.tick)));
    return shown(Between(before.pose, after.pose, share), false);
  }
  ++extrapolations_;
  // Ticks are the world's own seconds, whatever its rate on the wall.
  const double limit_ticks = std::chrono::duration<double>(Client::kMaxExtrapolation).count() * rate_hz;
  const double seconds = std::min(past, limit_ticks) / tick_rate_hz_;
  return shown(Ahead(before.pose, before.linear_velocity, before.angular_velocity, seconds), true);
}

}  // namespace tessera::client
