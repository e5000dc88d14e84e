#include "bench/penetration.h"

#include <algorithm>
#include <cassert>
#include <map>

#include "bench/engine_parts.h"
#include "core/physics/mass_properties.h"

namespace tessera::bench {
namespace {

constexpr double kMeshThickness_m = 0.5;

std::pair<BodyId, BodyId> Ordered(BodyId a, BodyId b) { return {std::min(a, b), std::max(a, b)}; }

Pose PoseOf(const BodyState& state) { return {state.position, Normalized(state.orientation)}; }

}  // namespace

struct Yardstick::Placed {
  std::size_t body;
  Solid solid;
  Aabb bounds;
};

std::vector<BodyState> StatesOf(const Engine& engine, const Scene& scene) {
  std::vector<BodyState> states;
  states.reserve(scene.bodies.size());
  for (const BodyDef& body : scene.bodies) states.push_back(engine.StateOf(body.id));
  return states;
}

Yardstick::Yardstick(const Scene& scene) {
  for (const JointDef& joint : scene.joints) {
    if (!joint.bodies_collide) exempt_.insert(Ordered(joint.body_a, joint.body_b));
  }
  for (const BodyDef& def : scene.bodies) {
    ids_.push_back(def.id);
    dynamic_.push_back(def.motion == Motion::kDynamic);
    if (dynamic_.back()) ++dynamic_count_;
    if (!def.trigger) AddShape(ids_.size() - 1, def);
  }
}

void Yardstick::AddShape(std::size_t body, const BodyDef& def) {
  const Pose initial = PoseOf(def.initial);
  const Vec3d center = physics::CenterOfMass(def);
  const auto add = [&](const Shape& shape, const Pose& pose) {
    parts_.push_back({body, Posed(SolidOf(shape), {pose.position - center, pose.orientation}), false});
  };
  if (const auto* plane = std::get_if<PlaneShape>(&def.shape->form)) {
    const Vec3d normal = Rotate(initial.orientation, plane->normal);
    planes_.push_back({body, normal, plane->offset_m + Dot(normal, initial.position)});
  } else if (const auto* compound = std::get_if<CompoundShape>(&def.shape->form)) {
    for (const CompoundChild& child : compound->children) {
      add(*child.shape, {child.pose.position, Normalized(child.pose.orientation)});
    }
  } else if (const auto* mesh = std::get_if<TriangleMeshShape>(&def.shape->form)) {
    const auto corner = [&](std::uint32_t i) {
      return initial.position + Rotate(initial.orientation, Vec3d(mesh->vertices[i]));
    };
    for (const auto& [i, j, k] : mesh->triangles) {
      parts_.push_back({body, PrismBelow(corner(i), corner(j), corner(k), kMeshThickness_m), true});
    }
  } else {
    assert(!std::holds_alternative<HeightFieldShape>(def.shape->form) && "height fields are not measured");
    add(*def.shape, {});
  }
}

bool Yardstick::Meet(std::size_t a, std::size_t b) const {
  if (a == b || (!dynamic_[a] && !dynamic_[b])) return false;
  return exempt_.empty() || !exempt_.contains(Ordered(ids_[a], ids_[b]));
}

std::vector<Yardstick::Placed> Yardstick::Place(std::span<const BodyState> states) const {
  std::vector<Placed> placed;
  placed.reserve(parts_.size());
  for (const Part& part : parts_) {
    Placed at{part.body, part.placed ? part.solid : Posed(part.solid, PoseOf(states[part.body])), {}};
    at.bounds = BoundsOf(at.solid);
    placed.push_back(std::move(at));
  }
  return placed;
}

Penetration Yardstick::Measure(std::span<const BodyState> states) const {
  assert(states.size() == ids_.size());
  std::vector<Placed> placed = Place(states);
  std::map<std::pair<std::size_t, std::size_t>, double> depths;  // the deepest of each pair's parts
  const auto note = [&](std::size_t a, std::size_t b, double depth) {
    if (depth <= 0) return;
    double& deepest = depths[{std::min(a, b), std::max(a, b)}];
    deepest = std::max(deepest, depth);
  };
  for (const Plane& plane : planes_) {
    for (const Placed& part : placed) {
      if (Meet(plane.body, part.body))
        note(plane.body, part.body, DepthInPlane(part.solid, plane.normal, plane.offset_m));
    }
  }
  // Sweep along x.
  std::sort(placed.begin(), placed.end(),
            [](const Placed& a, const Placed& b) { return a.bounds.min.x < b.bounds.min.x; });
  std::vector<const Placed*> open;
  for (const Placed& part : placed) {
    std::erase_if(open, [&](const Placed* other) { return other->bounds.max.x < part.bounds.min.x; });
    for (const Placed* other : open) {
      if (part.bounds.Overlaps(other->bounds) && Meet(part.body, other->body)) {
        note(part.body, other->body, DepthBetween(part.solid, other->solid));
      }
    }
    open.push_back(&part);
  }
  Penetration result;
  result.pairs = depths.size();
  for (const auto& [pair, depth] : depths) {
    result.sum_m += depth;
    result.sum_of_squares_m2 += depth * depth;
    if (depth <= result.deepest_m) continue;
    result.deepest_m = depth;
    result.deepest_a = ids_[pair.first];
    result.deepest_b = ids_[pair.second];
  }
  if (dynamic_count_ > 0) result.mean_per_body_m = result.sum_m / static_cast<double>(dynamic_count_);
  return result;
}

}  // namespace tessera::bench
