#include "core/region/border_loads.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <tuple>
#include <utility>

#include "core/region/ascends.h"
#include "core/world/state_check.h"

namespace tessera::region {
namespace {

// A load is sent as a mean over about so many ticks. Sent as it is, it comes back a tick later as the answer to itself,
// and a pile trembles for ever: with 10 a pile of 1240 boxes at rest moves by 1 mm/s, with 2.5 by 5 mm/s. With more,
// word of a load that has changed takes as much longer.
constexpr float kLoadTicks = 10;

// A load is at most so many times what the contact did in either of the last two steps: what a blow left of itself in
// the mean turns bodies long after it. Without this, two colliding blocks of 64 in two regions change their angular
// momentum by 9e-5 of it; with 1 by 4e-6, since loads that tremble are sent too small; with 2 by 5e-7.
constexpr float kMostLoad = 2;

// Part of an impulse that lasted from one tick to the next.
float Lasting(float before, float now) {
  if ((before > 0) != (now > 0)) return 0;
  return std::abs(before) < std::abs(now) ? before : now;
}
Vec3f Lasting(Vec3f before, Vec3f now) {
  return {Lasting(before.x, now.x), Lasting(before.y, now.y), Lasting(before.z, now.z)};
}

// The load of a contact after that of the tick before, and what it did in two successive steps.
Vec3f NextLoad(Vec3f load, Vec3f before, Vec3f now) {
  if (load == Vec3f()) return Lasting(before, now);
  const Vec3f mean = load + (now - load) / kLoadTicks;
  const float size_2 = Dot(mean, mean);
  const float most_2 = kMostLoad * kMostLoad * std::max(Dot(before, before), Dot(now, now));
  return size_2 > most_2 ? mean * std::sqrt(most_2 / size_2) : mean;
}

}  // namespace

void BorderLoads::Note(std::span<const physics::PairImpulse> contacts) {
  std::swap(active_, active_before_);
  active_.clear();
  active_.reserve(contacts.size());
  auto before = active_before_.begin();
  const auto behind = [](const LoadContact& active, const physics::PairImpulse& contact) {
    return std::tie(active.a, active.b) < std::tie(contact.body_a, contact.body_b);
  };
  for (const physics::PairImpulse& contact : contacts) {
    while (before != active_before_.end() && behind(*before, contact)) ++before;
    const BodyId a = contact.body_a, b = contact.body_b;
    const std::array now{contact.impulse_on_b, contact.angular_impulse_on_a, contact.angular_impulse_on_b};
    LoadContact& active = active_.emplace_back(LoadContact{a, b, contact.tag_a, contact.tag_b, {}, {}, {}, now});
    if (before == active_before_.end() || before->a != a || before->b != b) continue;
    active.impulse_on_b = NextLoad(before->impulse_on_b, before->last_step[0], now[0]);
    active.angular_on_a = NextLoad(before->angular_on_a, before->last_step[1], now[1]);
    active.angular_on_b = NextLoad(before->angular_on_b, before->last_step[2], now[2]);
  }
}

void BorderLoads::Clear() {
  active_.clear();
  active_before_.clear();
}

// A static body is everywhere. Whether a third region's body is a ghost of this neighbour is not known here: it is
// taken to be one if it reaches the neighbour's cells.
BorderLoads::Seen BorderLoads::SeenOf(BodyId id, std::uint32_t place, std::span<GhostRecord> ghosts,
                                      const Inputs& in) const {
  if (place == physics::kNoTag) return {nullptr, false, true};
  const std::size_t own = in.bodies.owned().size();
  const RegionId to = in.neighborhood[in.neighbor];
  if (place < own) {
    if (const std::uint32_t at = in.in_frame[place]; at != kNotInFrame) return {&ghosts[at], ghosts[at].settled, true};
    return {nullptr, false, DepartsTo(in.departing, id, to)};
  }
  const Ghost& ghost = in.bodies.ghosts()[place - own];
  if (ghost.owner == to) return {nullptr, false, true};
  const Aabb bounds = in.bodies.world().BoundsOf(id).Expanded(aura_m_);
  return {nullptr, ghost.record.settled, in.neighborhood.map().Reaches(to, bounds)};
}

void BorderLoads::AddTo(std::span<GhostRecord> ghosts, const Inputs& in) const {
  if (ghosts.empty()) return;
  const std::size_t own = in.bodies.owned().size();
  const auto is_whole = [&](std::uint32_t place) { return place < own && in.relevance.IsWhole(place); };
  const auto is_sent = [&](std::uint32_t place) { return place < own && in.in_frame[place] != kNotInFrame; };
  const auto settled = [&](std::uint32_t place) { return ghosts[in.in_frame[place]].settled; };
  for (const LoadContact& active : active_) {
    const bool sent_a = is_sent(active.place_a), sent_b = is_sent(active.place_b);
    if (!sent_a && !sent_b) continue;
    // The neighbour has both, and they touch there: no load is missing. In a pile that moves, most are such.
    if (sent_a && sent_b && !(settled(active.place_a) && settled(active.place_b))) continue;
    // Nor does it lack what is static.
    if (active.place_a == physics::kNoTag || active.place_b == physics::kNoTag) continue;
    // The neighbour has all of a whole island, whoever sends it.
    if (is_whole(active.place_a) || is_whole(active.place_b)) continue;
    const Seen a = SeenOf(active.a, active.place_a, ghosts, in), b = SeenOf(active.b, active.place_b, ghosts, in);
    const bool both_settled = a.settled && b.settled;
    if (a.in_frame != nullptr && (both_settled || !b.seen)) {
      a.in_frame->externally_supported = true;
      a.in_frame->load_ns -= active.impulse_on_b;
      a.in_frame->load_nms += active.angular_on_a;
    }
    if (b.in_frame != nullptr && (both_settled || !a.seen)) {
      b.in_frame->externally_supported = true;
      b.in_frame->load_ns += active.impulse_on_b;
      b.in_frame->load_nms += active.angular_on_b;
    }
  }
  for (GhostRecord& ghost : ghosts) {
    if (ghost.state.asleep) ghost.externally_supported = false;
    if (ghost.externally_supported) ghost.island_load = in.bodies.world().IslandLoadOf(ghost.id);
    const bool sane = IsSaneImpulse(ghost.load_ns) && IsSaneAngularImpulse(ghost.load_nms);
    if (!ghost.externally_supported || !sane) ghost.load_ns = ghost.load_nms = Vec3f();
  }
}

void BorderLoads::Validate() const {
  assert(Ascends(active_, [](const LoadContact& active) { return std::pair(active.a, active.b); }));
}

}  // namespace tessera::region
