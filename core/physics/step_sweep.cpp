// The end of a step: nothing passes through anything unseen, bodies move, and what is still falls asleep.
#include <algorithm>
#include <cmath>

#include "core/physics/tuning.h"
#include "core/physics/world_impl.h"

namespace tessera::physics {
namespace {

template <class Motion>
bool Finite(const Motion& motion) {
  return IsFinite(motion.position) && IsFinite(motion.orientation) && IsFinite(motion.velocity) &&
         IsFinite(motion.angular_momentum);
}

}  // namespace

Way World::Impl::WayOf(const RigidBody& body) const {
  const Placement& from = body.placement();
  if (!body.awake()) return {body.geometry(), from.position, from.position, from.orientation, {}};
  const Motion& motion = motions[body.awake_index];
  return {body.geometry(), from.position, motion.position, from.orientation, Vec3d(motion.turned_rad)};
}

// All that it may touch on its way, in the broad phase's coordinates.
Bounds World::Impl::Passed(const Way& way) const {
  const float outer = way.geometry.outer_radius_m;
  const Vec3f from(way.from - settings.origin), to(way.to - settings.origin), around{outer, outer, outer};
  return {Vec3f{std::min(from.x, to.x), std::min(from.y, to.y), std::min(from.z, to.z)} - around,
          Vec3f{std::max(from.x, to.x), std::max(from.y, to.y), std::max(from.z, to.z)} + around};
}

// Whether something pushed it off its course; and whether it moved by so much of its size that it may have passed
// through something, or came out so far from its course that the contacts which were looked for along that say little.
void World::Impl::NoteWay(RigidBody& body) {
  const Motion& motion = motions[body.awake_index];
  const Vec3f moved(motion.position - body.placement().position);
  const auto rim = [&body](Vec3f turned_rad) {
    return std::min(2.0f, Length(turned_rad)) * body.geometry().outer_radius_m;
  };
  const Vec3f expected_turn = body.course.spin_rad_s * static_cast<float>(dt_s);
  const float off = Length(moved - body.course.move_m) + rim(motion.turned_rad - expected_turn);
  body.astray = off > kAstray_m;
  const float fast = std::max(kFastShare * body.geometry().inner_radius_m, kSpeculative_m);
  if (off > kSpeculative_m || Length(moved) + rim(motion.turned_rad) > fast) racing.push_back(body.awake_index);
}

// Contacts were found along the way that each body was expected to take. One that is fast, and was knocked off it or
// meets something that was, is followed along the way it took, and stopped where it meets something; the next step
// finds the contact there.
void World::Impl::Sweep() {
  std::sort(racing.begin(), racing.end());
  for (const std::uint32_t index : racing) SweepBody(index);
}

void World::Impl::SweepBody(std::uint32_t index) {
  RigidBody& body = *awake[index];
  if (!body.astray && body.pairs.empty()) return;
  const Way way = WayOf(body);
  const Bounds swept = Passed(way);
  if (body.astray && !body.fat.Contains(swept)) {
    candidates.clear();
    broad_phase.Overlapping(swept, &candidates);
    for (RigidBody* other : candidates) {
      if (other == &body || pairs.Find(body, *other) != nullptr) continue;
      pairs.Begin(body, *other);
      pairs.Find(body, *other)->jointed = Jointed(body, *other);
    }
  }
  // Boxes that meet rim by rim, as where one slides over the seams of a floor of boxes, do not press on each other.
  const auto meet = [&](const Pair& pair, double fraction) {
    const Placement low = WayOf(*pair.low).At(fraction), high = WayOf(*pair.high).At(fraction);
    PairCache cache;
    Manifolds manifolds;
    Collide({pair.low->geometry(), low}, {pair.high->geometry(), high}, kSpeculative_m, cache, manifolds);
    return !manifolds.empty();
  };
  for (const auto& [pair, other] : body.pairs) {
    if (pair->jointed && !pair->trigger) continue;
    const bool as_expected = !body.astray && !(other->awake() && other->astray);
    if (!pair->trigger && (pair->manifolds.empty() ? as_expected : !GoesThrough(*pair))) continue;
    const std::optional<Impact> impact = FirstImpact(WayOf(*pair->low), WayOf(*pair->high), kImpactDistance_m);
    if (!impact) continue;
    if (pair->trigger) {
      // If nothing has it told yet.
      if (pair->manifolds.empty() && !pair->touching && !pair->crossed) parting.push_back(pair);
      pair->crossed = true;
    } else if (meet(*pair, impact->fraction)) {
      const Stop stop = Carries(body, *other) ? Stop{other->awake_index, impact->fraction, &body, {}, {}}
                                              : Stop{index, impact->fraction, other, {}, {}};
      if (stop.share < 1) stopped.push_back(stop);
    }
  }
}

// What was solved needs no sweep, unless it gave way: a rod that is stopped at its end turns about it, and most of it
// would be behind the wall by the end of the step.
bool World::Impl::GoesThrough(const Pair& pair) const {
  if (pair.swept) return true;
  const Way low = WayOf(*pair.low), high = WayOf(*pair.high);
  const Vec3d low_moved = low.to - low.from, high_moved = high.to - high.from;
  const float inner = kThroughShare * pair.inner_m;
  for (const Manifold& manifold : pair.manifolds) {
    const Vec3d on_low = low.from + Vec3d(manifold.points[0].r_a), on_high = high.from + Vec3d(manifold.points[0].r_b);
    if (pair.high->awake() && CameThrough(high, on_low, on_low + low_moved, manifold.normal) > inner) return true;
    if (pair.low->awake() && CameThrough(low, on_high, on_high + high_moved, -manifold.normal) > inner) return true;
  }
  return false;
}

void World::Impl::MoveBodies() {
  if (!stopped.empty()) MoveStopped();
  bool failed = false;
  for (std::uint32_t i = 0; i < awake.size(); ++i) {
    if (!Finite(motions[i])) islands.Of(i).failed = failed = true;
  }
  for (std::uint32_t i = 0; i < awake.size(); ++i) {
    RigidBody& body = *awake[i];
    body.force_n = body.torque_nm = {};
    const Motion& motion = motions[i];
    if (!islands.Of(i).failed) {
      body.Move(motion.position, motion.orientation, motion.velocity, motion.angular_momentum);
    }
    NoteStillness(body);
  }
  if (failed) FindFailing();
}

// What cannot happen while what comes in is sane. An island that fails stays where it was for a tick, and loses its
// fastest body: one a step, until what is left can be solved.
void World::Impl::FindFailing() {
  std::vector<RigidBody*> worst(islands.all().size(), nullptr);
  for (std::uint32_t i = 0; i < awake.size(); ++i) {
    if (!islands.Of(i).failed) continue;
    RigidBody*& candidate = worst[islands.IndexOf(i)];
    const auto speed = [](const RigidBody& body) { return Length(body.state().linear_velocity); };
    if (candidate == nullptr || speed(*awake[i]) > speed(*candidate) ||
        (speed(*awake[i]) == speed(*candidate) && awake[i]->id() < candidate->id())) {
      candidate = awake[i];
    }
  }
  for (RigidBody* body : worst) {
    if (body != nullptr) failing.push_back(body);
  }
}

void World::Impl::NoteStillness(RigidBody& body) {
  const BodyState& state = body.state();
  const bool still = body.may_sleep() && settings.sleep && Length(state.linear_velocity) < kSleepLinear_m_s &&
                     Length(state.angular_velocity) < kSleepAngular_rad_s;
  const float still_s = still ? state.still_s + static_cast<float>(dt_s) : 0.0f;
  body.SetStill(still_s);
  if (still_s < kSleepAfter_s) islands.Of(body.awake_index).sleepy = false;
}

void World::Impl::FallAsleep() {
  candidates.clear();
  for (std::uint32_t i = 0; i < awake.size(); ++i) {
    if (islands.Of(i).sleepy) candidates.push_back(awake[i]);
  }
  for (RigidBody* body : candidates) {
    UnlistAwake(*body);
    body->FallAsleep();
  }
}

}  // namespace tessera::physics
