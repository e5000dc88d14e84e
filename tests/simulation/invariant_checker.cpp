#include "tests/simulation/invariant_checker.h"

#include <algorithm>
#include <bit>

#include "absl/strings/str_cat.h"
#include "core/region/census.h"
#include "core/region/output_commit.h"
#include "core/world/spawned_id.h"
#include "core/world/state_check.h"

namespace tessera::simulation {
namespace {

constexpr std::size_t kMaxProblems = 20;

std::uint64_t Mixed(std::uint64_t hash, std::uint64_t value) {
  return region::Mix(BodyId(hash * 0x9e3779b97f4a7c15u ^ value));
}

}  // namespace

std::uint64_t HashOf(const BodyState& state) {
  std::uint64_t hash = state.asleep ? 1 : 0;
  for (const double v : {state.position.x, state.position.y, state.position.z, state.orientation.x, state.orientation.y,
                         state.orientation.z, state.orientation.w}) {
    hash = Mixed(hash, std::bit_cast<std::uint64_t>(v));
  }
  for (const float v : {state.linear_velocity.x, state.linear_velocity.y, state.linear_velocity.z,
                        state.angular_velocity.x, state.angular_velocity.y, state.angular_velocity.z,
                        state.angular_momentum.x, state.angular_momentum.y, state.angular_momentum.z, state.still_s}) {
    hash = Mixed(hash, std::bit_cast<std::uint32_t>(v));
  }
  return hash;
}

InvariantChecker::InvariantChecker(const Scene& scene) : scene_(scene) {
  for (const BodyDef& def : scene.bodies) {
    if (def.motion == Motion::kDynamic) expected_.insert(def.id);
  }
}

// Nobody may have heard of its last steps: others may go on from before them, at the same ticks and epochs. Two that
// die together may even have handed a body to and fro, and come to epochs that nobody else knows.
void InvariantChecker::Died(RegionId region) {
  // Whether its standby knows what it made and removed last, nobody can tell. What it made may live on, or be made anew
  // under the same id.
  orphans_.merge(untold_[region].made);
  untold_.erase(region);
  for (auto& [id, life] : lives_) {
    const Reign& newest = *std::max_element(life.reigns.begin(), life.reigns.end(),
                                            [](const Reign& a, const Reign& b) { return a.epoch < b.epoch; });
    if (newest.region == region) life.gone = false;  // it may come back to be removed again
    for (Reign& reign : life.reigns) {
      if (reign.region == region) reign = {};
    }
  }
}

void InvariantChecker::Stepped(RegionId region, Tick tick, std::span<const region::OwnedBody> owned,
                               const region::StepResult& result) {
  for (const region::Departure& departure : result.departures) {
    if (departure.reason != region::DepartureReason::kRemoved) continue;
    const bool not_finite =
        std::find(result.nonfinite.begin(), result.nonfinite.end(), departure.body) != result.nonfinite.end();
    // A body that nobody knew of may go as it came.
    const bool by_game = IsSpawned(departure.body) || removable_.contains(departure.body);
    if (by_game && untold_[region].made.erase(departure.body) == 0) {
      untold_[region].removed.emplace_back(tick, departure.body);
    }
    if (!not_finite && !by_game && !leaving_.contains(departure.body)) {
      Problem(tick, absl::StrCat("body ", departure.body.value(), " was removed unasked"));
    }
    Life& life = lives_[departure.body];
    life.gone = true;
    life.gone_at = tick;
    expected_.erase(departure.body);
  }
  Motions* motions = weighs_ ? &motions_[tick] : nullptr;
  if (motions != nullptr) ++motions->regions;
  for (const region::OwnedBody& body : owned) {
    Reigns(region, tick, body);
    hash_ += Mixed(Mixed(tick.value(), body.def->id.value()), HashOf(body.state));
    if (!IsSane(body.state))
      Problem(tick, absl::StrCat("body ", body.def->id.value(), " has a state that no region takes"));
    if (motions == nullptr) continue;
    const Vec3d v(body.state.linear_velocity);
    const double mass = body.def->mass_kg;
    ++motions->bodies;
    motions->momentum += v * mass;
    motions->size += Length(v) * mass;
    motions->energy_j +=
        mass * (0.5 * Dot(v, v) - Dot(scene_.gravity_m_s2 * body.def->gravity_scale, body.state.position)) +
        0.5 * Dot(Vec3d(body.state.angular_velocity), Vec3d(body.state.angular_momentum));
  }
}

void InvariantChecker::Reigns(RegionId region, Tick tick, const region::OwnedBody& body) {
  const BodyId id = body.def->id;
  if (told_removed_.contains(id)) {
    ++made_.came_back;
    Problem(tick, absl::StrCat("body ", id.value(), " of region ", region.value(), " came back after it was removed"));
  }
  if (orphans_.erase(id) > 0 || (IsSpawned(id) && body.epoch == Epoch(1) && !lives_.contains(id))) {
    untold_[region].made.insert(id);
  } else if (!expected_.contains(id) && !lives_.contains(id)) {
    Problem(tick, absl::StrCat("body ", id.value(), " of region ", region.value(), " came from nowhere"));
  }
  Life& life = lives_[id];
  if (life.gone && tick >= life.gone_at) {
    Problem(tick, absl::StrCat("body ", id.value(), " of region ", region.value(), " was removed at tick ",
                               life.gone_at.value()));
  }
  Reign& reign = life.reigns[body.epoch.value() % life.reigns.size()];
  if (reign.epoch > body.epoch) {
    Problem(tick, absl::StrCat("body ", id.value(), " of region ", region.value(), " has epoch ", body.epoch.value(),
                               ", after epoch ", reign.epoch.value()));
    return;
  }
  if (reign.epoch != body.epoch) {
    reign = {region, body.epoch, tick, tick};
  } else if (reign.region != region) {
    doubled_.insert(id);
    Problem(tick, absl::StrCat("body ", id.value(), " has two owners of epoch ", body.epoch.value(), ": regions ",
                               reign.region.value(), " and ", region.value()));
    return;
  }
  reign.last = std::max(reign.last, tick);
  for (const Reign& other : life.reigns) {
    if (other.epoch == Epoch() || other.epoch == body.epoch) continue;
    if (other.epoch < body.epoch) {
      Overlap(id, other, reign);
    } else {
      Overlap(id, reign, other);
    }
  }
}

void InvariantChecker::Overlap(BodyId id, const Reign& lower, const Reign& higher) {
  if (lower.last < higher.first) return;
  if (!doubled_.insert(id).second) return;
  Problem(lower.last,
          absl::StrCat("body ", id.value(), " has two owners: region ", lower.region.value(), " by epoch ",
                       lower.epoch.value(), " until tick ", lower.last.value(), ", region ", higher.region.value(),
                       " by epoch ", higher.epoch.value(), " from tick ", higher.first.value()));
}

void InvariantChecker::Told(const region::Region& region) {
  Untold& untold = untold_[region.id()];
  for (auto id = untold.made.begin(); id != untold.made.end();) {
    const bool here = region.Owns(*id);
    if (here && region.output().IsHidden(*id)) {
      ++id;
      continue;
    }
    expected_.insert(*id);
    ++made_.made;
    id = untold.made.erase(id);
  }
  std::erase_if(untold.removed, [&](const std::pair<Tick, BodyId>& one) {
    if (one.first > region.committed_tick()) return false;
    told_removed_.insert(one.second);
    ++made_.removed;
    return true;
  });
}

void InvariantChecker::CheckCopies(Tick tick, std::span<const BodyId> held) {
  std::vector<BodyId> sorted(held.begin(), held.end());
  std::sort(sorted.begin(), sorted.end());
  for (const BodyId id : expected_) {
    if (excused_.contains(id) || leaving_.contains(id) || lost_.contains(id)) continue;
    if (std::binary_search(sorted.begin(), sorted.end(), id)) continue;
    if (IsPlayerBody(id) && !lives_.contains(id)) continue;  // asked for, not made yet
    lost_.insert(id);
    Problem(tick, absl::StrCat("body ", id.value(), ": nobody has it"));
  }
}

void InvariantChecker::CheckOwners(Tick tick, std::span<const BodyId> owned) {
  std::vector<BodyId> sorted(owned.begin(), owned.end());
  std::sort(sorted.begin(), sorted.end());
  for (std::size_t i = 1; i < sorted.size(); ++i) {
    if (sorted[i] != sorted[i - 1]) continue;
    doubled_.insert(sorted[i]);
    Problem(tick, absl::StrCat("body ", sorted[i].value(), " has two owners at the end"));
  }
  for (const BodyId id : expected_) {
    if (excused_.contains(id) || leaving_.contains(id)) continue;
    if (std::binary_search(sorted.begin(), sorted.end(), id)) continue;
    lost_.insert(id);
    Problem(tick, absl::StrCat("body ", id.value(), " has no owner at the end"));
  }
}

void InvariantChecker::Problem(Tick tick, const std::string& what) {
  if (problems_.size() < kMaxProblems) problems_.push_back(absl::StrCat("tick ", tick.value(), ": ", what));
}

}  // namespace tessera::simulation
