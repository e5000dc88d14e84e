#include "core/physics/broad_phase.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/physics/query/tuning.h"
#include "core/physics/tuning.h"

namespace tessera::physics {
namespace {

// Bounds that overlap none.
constexpr float kFarthest = std::numeric_limits<float>::infinity();
constexpr Bounds kNowhere{{kFarthest, kFarthest, kFarthest}, {-kFarthest, -kFarthest, -kFarthest}};

// Number of noted bodies that a thread takes at a time.
constexpr std::size_t kChunkNoted = 16;

}  // namespace

PredictedMotion PredictMotion(const RigidBody& body, double dt_s) {
  const Vec3d a = body.Acceleration();
  const Vec3d v(body.state().linear_velocity);
  const Vec3f spin = body.state().angular_velocity;
  return {Vec3f(v * dt_s + a * (0.5 * dt_s * dt_s)), Vec3f(v + a * dt_s), spin,
          std::min(2.0f, Length(spin) * static_cast<float>(dt_s)) * body.geometry().outer_radius_m};
}

BroadPhase::BroadPhase(Vec3d origin, ThreadTeam& team) : origin_(origin), team_(team) {}

BroadPhase::Note& BroadPhase::NoteOf(const RigidBody& body) {
  std::vector<Note>& notes = notes_[TreeOf(body)];
  if (body.leaf >= notes.size()) notes.resize(body.leaf + 1);
  return notes[body.leaf];
}

void BroadPhase::NoteChange(RigidBody& body, const Bounds& before) {
  Note& note = NoteOf(body);
  if (note.round == round_) {
    noted_[note.index].before = kNowhere;
    return;
  }
  note = {round_, static_cast<std::uint32_t>(noted_.size())};
  noted_.push_back({&body, before});
}

void BroadPhase::Add(RigidBody& body) {
  body.reach = body.fat = TightBounds(body);
  body.leaf = trees_[TreeOf(body)].Insert(body.fat, body);
  NoteChange(body, kNowhere);
}

void BroadPhase::Remove(RigidBody& body) {
  Note& note = NoteOf(body);
  if (note.round == round_) noted_[note.index].body = nullptr;
  note = {};
  trees_[TreeOf(body)].Remove(body.leaf);
}

void BroadPhase::Move(RigidBody& body) {
  body.reach = TightBounds(body);
  if (body.fat.Contains(body.reach)) return;
  const Bounds before = std::exchange(body.fat, Widened(body));
  Refit(body, before);
}

Bounds BroadPhase::Widened(const RigidBody& body) {
  const auto ahead = [](float move_m) { return std::clamp(kBoundsAhead * move_m, -kMostAhead_m, kMostAhead_m); };
  const Vec3f move = body.predicted.move_m;
  return body.reach.Grown(body.dynamic() || body.kinematic() ? kBoundsMargin_m : 0)
      .Swept({ahead(move.x), ahead(move.y), ahead(move.z)});
}

// Takes note that the bounds of a body are no longer those before.
void BroadPhase::Refit(RigidBody& body, const Bounds& before) {
  trees_[TreeOf(body)].Update(body.leaf, body.fat);
  NoteChange(body, before);
}

bool BroadPhase::Predict(RigidBody& body, double dt_s) const {
  body.predicted = PredictMotion(body, dt_s);
  const float grow = kSpeculative_m + std::min(body.predicted.sweep_m, body.geometry().outer_radius_m);
  body.reach = TightBounds(body).Swept(body.predicted.move_m).Grown(grow);
  return !body.fat.Contains(body.reach);
}

void BroadPhase::Predict(std::span<RigidBody* const> awake, double dt_s, std::span<RigidBody* const> moving) {
  outgrown_.resize(awake.size());
  before_.resize(awake.size());
  team_.For(awake.size(), kChunkBodies, [this, awake, dt_s](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      PrefetchAfter(i, awake, kUpToFrame);
      RigidBody& body = *awake[i];
      body.PrepareDamping(dt_s);
      outgrown_[i] = Predict(body, dt_s) ? 1 : 0;
      if (outgrown_[i] != 0) before_[i] = std::exchange(body.fat, Widened(body));
    }
  });
  for (std::size_t i = 0; i < awake.size(); ++i) {
    if (outgrown_[i] != 0) Refit(*awake[i], before_[i]);
  }
  for (RigidBody* body : moving) {
    body->driven_s = dt_s;
    if (!Predict(*body, dt_s)) continue;
    const Bounds before = std::exchange(body->fat, Widened(*body));
    Refit(*body, before);
  }
}

void BroadPhase::BeginPairs(PairTable* pairs) {
  if (noted_.empty()) return;
  for (std::vector<Meeting>& met : met_) met.clear();
  met_.resize(std::max(met_.size(), (noted_.size() - 1) / kChunkNoted + 1));
  team_.For(noted_.size(), kChunkNoted, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) FindMeetings(noted_[i], i, &met_[begin / kChunkNoted]);
  });
  for (const std::vector<Meeting>& met : met_) {
    for (const Meeting& meeting : met) pairs->Begin(*meeting.a, *meeting.b);
  }
  noted_.clear();
  ++round_;
}

// Bodies whose bounds overlapped when pairs were begun last have a pair. Of two that have both changed, the first one
// finds the other.
void BroadPhase::FindMeetings(const Noted& noted, std::size_t index, std::vector<Meeting>* met) const {
  if (noted.body == nullptr) return;
  const bool dynamic = noted.body->dynamic();
  for (const std::size_t tree : {std::size_t{0}, std::size_t{1}}) {
    if (tree == 1 && !dynamic) continue;
    trees_[tree].Overlapping(noted.body->fat, [&](BoundsTree::Leaf leaf, const Bounds& bounds) {
      const Note& other = notes_[tree][leaf];
      const bool changed = other.round == round_;
      if (changed && other.index <= index) return;
      if (noted.before.Overlaps(changed ? noted_[other.index].before : bounds)) return;
      met->push_back({noted.body, &trees_[tree].BodyOf(leaf)});
    });
  }
}

Bounds BroadPhase::TightBounds(const RigidBody& body) const {
  const Geometry& geometry = body.geometry();
  if (geometry.kind == GeometryKind::kPlane) {
    return {{-kEverywhere_m, -kEverywhere_m, -kEverywhere_m}, {kEverywhere_m, kEverywhere_m, kEverywhere_m}};
  }
  return BoundsOf(geometry, body.placement().rotation).Moved(Vec3f(body.placement().position - origin_));
}

Bounds BroadPhase::SweptBounds(const SweptMotion& motion) const {
  const float outer = motion.geometry.outer_radius_m;
  const Vec3f from(motion.from - origin_), to(motion.to - origin_), around{outer, outer, outer};
  return {Vec3f{std::min(from.x, to.x), std::min(from.y, to.y), std::min(from.z, to.z)} - around,
          Vec3f{std::max(from.x, to.x), std::max(from.y, to.y), std::max(from.z, to.z)} + around};
}

void BroadPhase::Overlapping(const Bounds& bounds, std::vector<RigidBody*>* bodies) {
  for (const BoundsTree& tree : trees_) {
    tree.Overlapping(bounds, [&](BoundsTree::Leaf leaf, const Bounds&) { bodies->push_back(&tree.BodyOf(leaf)); });
  }
}

void BroadPhase::Along(const Way& way, Vec3d half_m, absl::FunctionRef<bool(RigidBody&)> visit) const {
  const auto crosses = [&](const Bounds& bounds) {
    const Vec3d min(bounds.min), max(bounds.max);
    const double margin = kQueryMargin_m + kQueryMarginShare * std::max(Length(min), Length(max));
    return way.PartIn(Aabb{min - half_m, max + half_m}.Expanded(margin)).has_value();
  };
  for (const BoundsTree& tree : trees_) {
    if (!tree.Walk(crosses, [&](BoundsTree::Leaf leaf) { return visit(tree.BodyOf(leaf)); })) return;
  }
}

bool BroadPhase::Validate(std::span<RigidBody* const> awake) {
  return std::all_of(awake.begin(), awake.end(), [](const RigidBody* body) {
    return IsFinite(body->reach.min) && IsFinite(body->reach.max) && body->fat.Contains(body->reach);
  });
}

}  // namespace tessera::physics
