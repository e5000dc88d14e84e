#include "core/physics/rigid_body.h"

#include <algorithm>

#include "core/physics/motion/free_flight.h"
#include "core/physics/motion/turn.h"
#include "core/physics/tuning.h"

namespace tessera::physics {
namespace {

// Whether the three moments are so near to one another that a turn changes nothing.
bool IsRound(Vec3d inertia) {
  const double most = std::max({inertia.x, inertia.y, inertia.z}), least = std::min({inertia.x, inertia.y, inertia.z});
  return most - least <= kSymmetryTolerance * most;
}

}  // namespace

RigidBody::RigidBody(const BodyDef& def, BodyForm form, const BodyState& state, Vec3d gravity)
    : id_(def.id),
      dynamic_(def.motion == Motion::kDynamic && !def.kinematic),
      kinematic_(def.kinematic),
      trigger_(def.trigger),
      may_sleep_(def.may_sleep),
      round_(dynamic_ && IsRound(form.inertia)),
      geometry_(std::move(form.geometry)),
      mass_kg_(dynamic_ ? def.mass_kg : 0),
      inertia_(dynamic_ ? form.inertia : Vec3d()),
      material_(def.material),
      layer_(def.layer),
      gravity_(dynamic_ ? gravity * def.gravity_scale : Vec3d()),
      linear_damping_(def.linear_damping),
      angular_damping_(def.angular_damping),
      frame_(form.frame) {
  Set(state);
}

Pose RigidBody::LocalFrame(const Pose& in_shape) const { return frame_.FromShape(in_shape); }

RigidBody::Change RigidBody::Compare(const BodyState& state) const {
  BodyState same = state;
  if (!dynamic_) same.angular_momentum = {};
  if (!dynamic_ && !kinematic_) same.linear_velocity = same.angular_velocity = {};
  const bool wants_sleep = dynamic_ && may_sleep_ && state.asleep;
  same.asleep = state_.asleep;
  same.still_s = state_.still_s;
  // A state that was set by its angular velocity alone compares by it.
  if (same.angular_velocity == state_.angular_velocity) same.angular_momentum = state_.angular_momentum;
  if (same == state_) return wants_sleep && !state_.asleep ? Change::kSilent : Change::kNone;
  if (wants_sleep) return Change::kSilent;
  if (!state_.asleep || kinematic_) return Change::kMoves;
  const Quatd turn = Conjugate(rest_orientation_) * state.orientation;
  const bool creeps =
      Length(state.linear_velocity) < kSleepLinear_m_s && Length(state.angular_velocity) < kSleepAngular_rad_s &&
      Length(state.position - rest_position_) < kCreep_m && Length(Vec3d{turn.x, turn.y, turn.z}) < kCreep_rad / 2;
  return creeps ? Change::kSilent : Change::kMoves;
}

void RigidBody::Set(const BodyState& state) {
  const bool stays_asleep = state_.asleep && !state.asleep && Compare(state) != Change::kMoves;
  state_ = state;
  if (!dynamic_) {
    if (!kinematic_) state_.linear_velocity = state_.angular_velocity = {};
    state_.angular_momentum = {};
    state_.asleep = kinematic_ && state_.linear_velocity == Vec3f() && state_.angular_velocity == Vec3f();
    state_.still_s = 0;
    if (state_.asleep) predicted = {};
  }
  placement_ = PlacementOf(state_);
  if (dynamic_) {
    const Quatd& axes = placement_.orientation;
    if (AngularVelocityOf(inertia_, axes, state_.angular_momentum) != state_.angular_velocity) {
      state_.angular_momentum = AngularMomentumOf(inertia_, axes, state_.angular_velocity);
    }
    state_.asleep = (state.asleep || stays_asleep) && may_sleep_;
    if (state_.asleep && !stays_asleep) NoteRest();
  }
}

Placement RigidBody::PlacementOf(const BodyState& state) const {
  const Quatd orientation = Normalized(state.orientation);
  Placement placement;
  placement.position = state.position;
  if (!dynamic_ && !kinematic_) placement.position += Rotate(orientation, frame_.origin);
  placement.orientation = frame_.turned() ? orientation * frame_.axes : orientation;
  placement.rotation = RotationOf(placement.orientation);
  return placement;
}

void RigidBody::Move(Vec3d position, Quatd orientation, Vec3f velocity, Vec3f angular_momentum) {
  state_.position = position;
  state_.orientation = Normalized(frame_.turned() ? orientation * Conjugate(frame_.axes) : orientation);
  placement_ = PlacementOf(state_);  // as another world computes it from this state
  SetMotion(velocity, angular_momentum);
}

void RigidBody::Advance(double dt_s) {
  state_.position += Vec3d(state_.linear_velocity) * dt_s;
  state_.orientation = Turned(state_.orientation, Vec3d(state_.angular_velocity) * dt_s);
  placement_ = PlacementOf(state_);
}

void RigidBody::SetMotion(Vec3f velocity, Vec3f angular_momentum) {
  state_.linear_velocity = velocity;
  state_.angular_momentum = angular_momentum;
  state_.angular_velocity = AngularVelocityOf(inertia_, placement_.orientation, angular_momentum);
}

void RigidBody::FallAsleep() {
  predicted = {};
  state_.asleep = true;
  state_.linear_velocity = state_.angular_velocity = state_.angular_momentum = {};
  NoteRest();
}

void RigidBody::Wake() {
  if (!dynamic_ || !state_.asleep) return;
  state_.asleep = false;
  state_.still_s = 0;
}

void RigidBody::NoteRest() {
  rest_position_ = state_.position;
  rest_orientation_ = state_.orientation;
}

}  // namespace tessera::physics
