#include "core/physics/body.h"

#include <LinearMath/btMatrix3x3.h>

#include "core/physics/bullet_math.h"
#include "core/physics/tuning.h"

namespace tessera::physics {

Body::Body(const BodyDef& def, BodyForm form, const BodyState& state, Vec3d origin, Vec3d gravity)
    : id_(def.id),
      dynamic_(def.motion == Motion::kDynamic),
      trigger_(def.trigger),
      may_sleep_(def.may_sleep),
      mass_kg_(dynamic_ ? def.mass_kg : 0),
      scene_shape_(def.shape),
      form_(std::move(form)),
      state_(state) {
  if (!form_.shape) PlacePlane(origin);
  btRigidBody::btRigidBodyConstructionInfo info(static_cast<btScalar>(mass_kg_), nullptr, form_.shape->bullet(),
                                                ToBullet(form_.inertia));
  info.m_friction = static_cast<btScalar>(def.material.friction);
  info.m_rollingFriction = static_cast<btScalar>(def.material.rolling_friction);
  info.m_spinningFriction = static_cast<btScalar>(def.material.spinning_friction);
  info.m_restitution = static_cast<btScalar>(def.material.restitution);
  info.m_linearDamping = static_cast<btScalar>(def.linear_damping);
  info.m_angularDamping = static_cast<btScalar>(def.angular_damping);
  info.m_linearSleepingThreshold = kSleepLinear_m_s;
  info.m_angularSleepingThreshold = kSleepAngular_rad_s;
  bullet_ = std::make_unique<btRigidBody>(info);
  bullet_->setUserPointer(this);
  bullet_->setFlags(bullet_->getFlags() | BT_DISABLE_WORLD_GRAVITY);
  bullet_->setGravity(ToBullet(gravity * def.gravity_scale));
  if (trigger_) bullet_->setCollisionFlags(bullet_->getCollisionFlags() | btCollisionObject::CF_NO_CONTACT_RESPONSE);
  if (form_.shape->bullet()->isConcave()) {  // has edges inside: see InstallContactRules
    bullet_->setCollisionFlags(bullet_->getCollisionFlags() | btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
  }
  if (dynamic_ && !may_sleep_) bullet_->setActivationState(DISABLE_DEACTIVATION);
  Set(state, origin);
}

btTransform Body::LocalFrame(const Pose& in_shape) const {
  const Quatd to_inner = Conjugate(form_.frame.axes);
  return ToBullet(
      Pose{Rotate(to_inner, in_shape.position - form_.frame.origin), to_inner * Normalized(in_shape.orientation)});
}

Body::Change Body::Compare(const BodyState& state) const {
  BodyState same = state;
  if (!dynamic_) {
    same.linear_velocity = same.angular_velocity = same.angular_momentum = {};
    same.still_s = 0;
  }
  const bool wants_sleep = dynamic_ && may_sleep_ && state.asleep;
  same.asleep = state_.asleep;
  if (same == state_) return wants_sleep && !state_.asleep ? Change::kSilent : Change::kNone;
  if (wants_sleep) return Change::kSilent;
  if (!state_.asleep) return Change::kMoves;
  const Quatd turn = Conjugate(rest_orientation_) * state.orientation;
  const bool creeps = Length(state.linear_velocity) < kSleepLinear_m_s &&
                      Length(state.angular_velocity) < kSleepAngular_rad_s &&
                      Length(state.position - rest_position_) < kCreep_m &&
                      Length(Vec3d{turn.x, turn.y, turn.z}) < double{kCreep_rad} / 2;
  return creeps ? Change::kSilent : Change::kMoves;
}

void Body::Set(const BodyState& state, Vec3d origin) {
  const bool stays_asleep = state_.asleep && !state.asleep && Compare(state) != Change::kMoves;
  state_ = state;
  if (!dynamic_) {
    if (std::holds_alternative<PlaneShape>(scene_shape_->form)) {
      PlacePlane(origin);
      bullet_->setCollisionShape(form_.shape->bullet());
    }
    state_.linear_velocity = state_.angular_velocity = state_.angular_momentum = {};
    state_.still_s = 0;
    state_.asleep = false;
  }
  bullet_->setLinearVelocity(ToBullet(state_.linear_velocity));
  bullet_->setAngularVelocity(ToBullet(state_.angular_velocity));
  bullet_->setCenterOfMassTransform(InnerTransform(origin));
  if (!dynamic_) return;
  state_.asleep = (state.asleep || stays_asleep) && may_sleep_;
  if (state_.asleep) {
    bullet_->forceActivationState(ISLAND_SLEEPING);
    if (!stays_asleep) NoteRest();
  } else if (!bullet_->isActive()) {
    Wake();  // one that is awake keeps the time for which it has been slow
  }
}

btTransform Body::InnerTransform(Vec3d origin) const {
  if (std::holds_alternative<PlaneShape>(scene_shape_->form)) return btTransform::getIdentity();
  const Quatd orientation = Normalized(state_.orientation);
  Vec3d position = state_.position - origin;
  if (!dynamic_) position += Rotate(orientation, form_.frame.origin);
  return btTransform(ToBullet(orientation * form_.frame.axes), ToBullet(position));
}

void Body::NoteRest() {
  rest_position_ = state_.position;
  rest_orientation_ = state_.orientation;
}

void Body::Publish(Vec3d origin) {
  PublishVelocity();
  btTransform transform = bullet_->getCenterOfMassTransform();
  state_.position = origin + Vec3d(FromBullet(transform.getOrigin()));
  state_.orientation = OutwardOrientation(transform.getRotation());
  transform.setRotation(ToBullet(Normalized(state_.orientation) * form_.frame.axes));
  bullet_->setCenterOfMassTransform(transform);
  state_.asleep = bullet_->getActivationState() == ISLAND_SLEEPING;
  if (state_.asleep) NoteRest();
}

void Body::PublishVelocity() {
  state_.linear_velocity = FromBullet(bullet_->getLinearVelocity());
  state_.angular_velocity = FromBullet(bullet_->getAngularVelocity());
  state_.angular_momentum = {};  // Bullet keeps velocities
  state_.still_s = 0;
}

Quatd Body::OutwardOrientation(const btQuaternion& inner) const {
  return Normalized(Quatd(FromBullet(inner)) * Conjugate(form_.frame.axes));
}

void Body::Wake() {
  if (!dynamic_) return;
  state_.asleep = false;
  bullet_->activate(true);
}

// A plane has no place of its own in Bullet: its shape is the whole half space in local coordinates. Reckoned in
// doubles, so that a body far from the plane's own origin meets it as exactly as one near by.
void Body::PlacePlane(Vec3d origin) {
  const auto& plane = std::get<PlaneShape>(scene_shape_->form);
  const double length = Length(plane.normal);
  const Vec3d normal = Rotate(Normalized(state_.orientation), plane.normal / length);
  form_.shape = MakePlane(normal, plane.offset_m / length + Dot(normal, state_.position - origin));
}

}  // namespace tessera::physics
