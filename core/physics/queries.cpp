#include "core/physics/queries.h"

#include <algorithm>
#include <cassert>
#include <optional>
#include <span>

#include "core/physics/query/tuning.h"

namespace tessera::physics {
namespace {

// The order of hits, whoever found them.
bool Precedes(double fraction_a, BodyId a, double fraction_b, BodyId b) {
  return fraction_a != fraction_b ? fraction_a < fraction_b : a < b;
}

bool Passes(const QueryFilter& filter, const std::vector<BodyId>& ignored, const PastBody& body) {
  return (filter.layers >> body.layer & 1) != 0 && (body.dynamic ? filter.dynamic_bodies : filter.static_bodies) &&
         (filter.triggers || !body.trigger) && !std::binary_search(ignored.begin(), ignored.end(), body.id);
}

bool Passes(const QueryFilter& filter, const std::vector<BodyId>& ignored, const RigidBody& body) {
  return !body.isolated && (filter.layers >> body.layer().index & 1) != 0 &&
         (body.dynamic() ? filter.dynamic_bodies : filter.static_bodies) && (filter.triggers || !body.trigger()) &&
         !std::binary_search(ignored.begin(), ignored.end(), body.id());
}

Aabb Widened(Vec3d min, Vec3d max, Vec3d half_m) {
  const double margin = kQueryMargin_m + kQueryMarginShare * std::max(Length(min), Length(max));
  return Aabb{min - half_m, max + half_m}.Expanded(margin);
}

void SortUnique(std::vector<BodyId>* ids) {
  std::sort(ids->begin(), ids->end());
  ids->erase(std::unique(ids->begin(), ids->end()), ids->end());
}

struct PlacedBody {
  BodyId id;
  const Geometry& geometry;
  Vec3d position;
  Quatd orientation;
};

std::optional<QueryHit> HitOn(const PlacedBody& body, const BodyQuery& query, const Probe* probe, WorkMeter& meter) {
  const Quatd into = Conjugate(body.orientation);
  const LocalRay ray{Rotate(into, query.from - body.position), Rotate(into, query.to - query.from)};
  const std::optional<SurfaceHit> hit = Meet(body.geometry, body.orientation, ray, probe, meter);
  if (!hit) return {};
  return QueryHit{.body = body.id,
                  .fraction = hit->fraction,
                  .point = body.position + Rotate(body.orientation, hit->point),
                  .normal = Rotate(body.orientation, hit->normal)};
}

}  // namespace

QueryResult Queries::Find(const BodyQuery& query, const BodyPredicate& accept) {
  assert(IsFinite(query.from) && IsFinite(query.to) && query.most_hits > 0);
  WorkMeter meter(query.most_work);
  meter.Spend(kQueryWork);
  std::optional<Probe> probe;
  if (!std::holds_alternative<PointProbe>(query.shape)) probe.emplace(query.shape, query.orientation);
  const Vec3d half = probe ? probe->In({}).half_m : Vec3d();
  const Way way{query.from - origin_, query.to - query.from};
  QueryResult result;
  std::vector<Candidate> candidates;
  std::vector<PastBody> past;
  const bool looks_back = LooksBack(query);
  if (!looks_back || query.scope != QueryScope::kOwned) candidates = CandidatesOf(query, way, half, meter);
  if (looks_back) {
    AddPast(query, way, half, meter, candidates, past);
    result.known = history_->Covers(*query.at_tick);
  }
  std::sort(candidates.begin(), candidates.end(),
            [](const Candidate& a, const Candidate& b) { return Precedes(a.entry, a.id, b.entry, b.id); });
  std::vector<QueryHit>& hits = result.hits;
  const auto earlier = [](const QueryHit& a, const QueryHit& b) {
    return Precedes(a.fraction, a.body, b.fraction, b.body);
  };
  for (const Candidate& candidate : candidates) {
    if (meter.exhausted()) break;
    const bool full = hits.size() == query.most_hits;
    if (full && !Precedes(candidate.entry, candidate.id, hits.back().fraction, hits.back().body)) break;
    if (accept != nullptr && (!meter.Spend(kAcceptWork) || !accept(candidate.id))) continue;
    const RigidBody* const body = candidate.body;
    const PlacedBody placed =
        body != nullptr
            ? PlacedBody{body->id(), body->geometry(), body->placement().position, body->placement().orientation}
            : PlacedBody{candidate.id, *past[candidate.past].geometry, past[candidate.past].position,
                         past[candidate.past].orientation};
    const std::optional<QueryHit> hit = HitOn(placed, query, probe ? &*probe : nullptr, meter);
    if (!hit) continue;
    hits.insert(std::upper_bound(hits.begin(), hits.end(), *hit, earlier), *hit);
    if (hits.size() > query.most_hits) hits.pop_back();
  }
  result.complete = !meter.exhausted();
  if (!result.complete) hits.clear();
  result.work = query.most_work - meter.left();
  return result;
}

std::vector<Queries::Candidate> Queries::CandidatesOf(const BodyQuery& query, const Way& way, Vec3d half_m,
                                                      WorkMeter& meter) {
  // Strays are awake, and so dynamic: who looks for static bodies alone has nothing to do with them.
  if (query.filter.dynamic_bodies) FindStrays();
  const std::span<RigidBody* const> strays(strays_.data(), query.filter.dynamic_bodies ? strays_.size() : 0);
  std::vector<BodyId> ignored = query.filter.ignored;
  SortUnique(&ignored);
  std::vector<Candidate> candidates;
  const bool looks_back = LooksBack(query);
  const auto visit = [&](RigidBody& body) {
    if (looks_back && (body.dynamic() || body.kinematic())) return true;  // it is found where it was
    if (!Passes(query.filter, ignored, body)) return true;
    const Bounds bounds = broad_phase_.TightBounds(body);
    const std::optional<WayPart> part = way.PartIn(Widened(Vec3d(bounds.min), Vec3d(bounds.max), half_m));
    if (!part) return true;
    candidates.push_back({.entry = part->begin, .id = body.id(), .body = &body});
    return meter.Spend(kCandidateWork);
  };
  // A stray may be in the trees' bounds all the same.
  for (RigidBody* body : strays) {
    if (!visit(*body)) return candidates;
  }
  broad_phase_.Along(way, half_m, [&](RigidBody& body) {
    return std::binary_search(strays.begin(), strays.end(), &body) || visit(body);
  });
  return candidates;
}

void Queries::AddPast(const BodyQuery& query, const Way& way, Vec3d half_m, WorkMeter& meter,
                      std::vector<Candidate>& candidates, std::vector<PastBody>& past) const {
  std::vector<BodyId> ignored = query.filter.ignored;
  SortUnique(&ignored);
  const auto part_of = [&](Vec3d middle, double radius_m) {
    const Vec3d radius{radius_m, radius_m, radius_m}, local = middle - origin_;
    return way.PartIn(Widened(local - radius, local + radius, half_m));
  };
  const auto may_meet = [&](Vec3d middle, double radius_m) {
    return meter.Spend(kPastWork) && part_of(middle, radius_m).has_value();
  };
  history_->Visit(*query.at_tick, query.scope, bodies_, may_meet, [&](const PastBody& body, double radius_m) {
    if (!Passes(query.filter, ignored, body)) return true;
    const std::optional<WayPart> part = part_of(body.position, radius_m);
    if (!part) return true;
    candidates.push_back({.entry = part->begin, .id = body.id, .body = nullptr, .past = past.size()});
    past.push_back(body);
    return meter.Spend(kCandidateWork);
  });
}

void Queries::FindStrays() {
  if (strays_known_) return;
  strays_.clear();
  for (RigidBody* body : bodies_.awake()) {
    if (!body->isolated && !body->fat.Contains(broad_phase_.TightBounds(*body))) strays_.push_back(body);
  }
  std::sort(strays_.begin(), strays_.end());
  strays_known_ = true;
}

std::vector<BodyId> Queries::Overlapping(const Aabb& box) {
  FindStrays();
  const Bounds bounds{Vec3f(box.min - origin_), Vec3f(box.max - origin_)};
  std::vector<BodyId> ids;
  const auto visit = [&](const RigidBody& body) {
    if (!body.isolated && broad_phase_.TightBounds(body).Overlaps(bounds)) ids.push_back(body.id());
    return true;
  };
  for (const RigidBody* body : strays_) visit(*body);
  const Vec3d min(bounds.min), max(bounds.max);
  broad_phase_.Along({(min + max) / 2.0, {}}, (max - min) / 2.0, visit);
  SortUnique(&ids);
  return ids;
}

}  // namespace tessera::physics
