// LooseBodies: bodies, joints and pairs without a World, to test a part or a pass by itself.
//
//   LooseBodies loose;
//   RigidBody& ball = loose.Add(Dynamic(1, Ball(), {0, 5, 0}));
//   Pair& pair = loose.AddContact(ball, ground, {.normal = {0, 1, 0}, .separation_m = 0});
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "core/physics/active_contact.h"
#include "core/physics/body_form.h"
#include "core/physics/body_store.h"
#include "core/physics/pair_table.h"
#include "core/physics/testing/bodies.h"
#include "core/physics/waking.h"

namespace tessera::physics {

class LooseBodies {
 public:
  explicit LooseBodies(Vec3d gravity_m_s2 = {0, -kGravity, 0}) : gravity_m_s2_(gravity_m_s2) {}

  // Takes a body in, and lists it as awake if its first state is.
  RigidBody& Add(const BodyDef& def) {
    RigidBody& body = bodies.Add(std::make_unique<RigidBody>(def, forms_.Of(def), def.initial, gravity_m_s2_));
    body.PrepareDamping(kDt);
    if (body.awake()) waking.Activate(body);
    return body;
  }

  // Begins a pair, and gives it a manifold of one point between the two centres. The normal points from the body with
  // the lower id to the other one.
  Pair& AddContact(RigidBody& a, RigidBody& b, Vec3f normal, float separation_m = 0) {
    pairs.Begin(a, b);
    Pair& pair = *pairs.Find(a, b);
    Manifold& manifold = pair.manifolds.emplace_back();
    manifold.normal = normal;
    manifold.count = 1;
    const Vec3f apart(pair.high->placement().position - pair.low->placement().position);
    manifold.points[0] = {.r_a = apart * 0.5f, .r_b = apart * -0.5f, .separation_m = separation_m};
    pair.separation_m = separation_m;
    pair.live = true;
    pair.searched = true;
    return pair;
  }

  BodyStore bodies;
  PairTable pairs;
  Waking waking{bodies, pairs};

 private:
  Vec3d gravity_m_s2_;
  FormCache forms_;
};

// A contact between two bodies as the narrow phase lists it: by awake_index, or kAsleep.
inline ActiveContact ContactBetween(std::uint32_t low, std::uint32_t high, Vec3f normal = {0, 1, 0}) {
  return {.pair = nullptr,
          .low = low,
          .high = high,
          .low_tag = kNoTag,
          .high_tag = kNoTag,
          .manifolds = nullptr,
          .count = 1,
          .substeps = 0,
          .responds = true,
          .live = true,
          .driven = false,
          .points = 0,
          .penetration_m = 0,
          .impact_m_s = 0,
          .load_ns = 0,
          .inner_m = 0.5f,
          .slop_m = 0,
          .normal = normal,
          .material = {}};
}

inline JointDef PointBetween(std::uint32_t id, std::uint64_t a, std::uint64_t b, Vec3d in_a, Vec3d in_b) {
  return {.id = JointId(id),
          .body_a = BodyId(a),
          .body_b = BodyId(b),
          .frame_a = {in_a, {}},
          .frame_b = {in_b, {}},
          .bodies_collide = false,
          .kind = PointJoint{}};
}

}  // namespace tessera::physics
