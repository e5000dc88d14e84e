// Conversions between our vectors and Bullet's. Bullet's types stay inside core/physics.
#pragma once

#include <LinearMath/btQuaternion.h>
#include <LinearMath/btTransform.h>
#include <LinearMath/btVector3.h>

#include "core/physics/linear.h"
#include "core/world/math.h"

namespace tessera::physics {

inline btVector3 ToBullet(Vec3f v) { return {v.x, v.y, v.z}; }
inline btVector3 ToBullet(Vec3d v) { return ToBullet(Vec3f(v)); }
inline btQuaternion ToBullet(Quatf q) { return {q.x, q.y, q.z, q.w}; }
inline btQuaternion ToBullet(Quatd q) { return ToBullet(Quatf(q)); }
inline btMatrix3x3 ToBullet(const Mat3f& m) { return {m.x.x, m.y.x, m.z.x, m.x.y, m.y.y, m.z.y, m.x.z, m.y.z, m.z.z}; }
inline btTransform ToBullet(const Pose& pose) {
  return btTransform(ToBullet(Normalized(pose.orientation)), ToBullet(pose.position));
}

inline Vec3f FromBullet(const btVector3& v) { return {v.x(), v.y(), v.z()}; }
inline Quatf FromBullet(const btQuaternion& q) { return {q.x(), q.y(), q.z(), q.w()}; }

}  // namespace tessera::physics
