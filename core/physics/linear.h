// Rotation matrices and symmetric tensors in single precision, for collision and solving.
#pragma once

#include <array>

#include "core/world/math.h"

namespace tessera::physics {

// The axes after each of x, y, z, in turn.
inline constexpr int kNext[3] = {1, 2, 0}, kAfter[3] = {2, 0, 1};

inline std::array<double, 3> ArrayOf(Vec3d v) { return {v.x, v.y, v.z}; }

// A rotation. Its columns are the images of the axes x, y, z.
struct Mat3f {
  Vec3f x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};

  friend constexpr Vec3f operator*(const Mat3f& m, Vec3f v) { return m.x * v.x + m.y * v.y + m.z * v.z; }
  friend constexpr Mat3f operator*(const Mat3f& a, const Mat3f& b) { return {a * b.x, a * b.y, a * b.z}; }
  friend constexpr bool operator==(const Mat3f&, const Mat3f&) = default;
};

// transpose(m) * v: takes v into the coordinates of a rotation.
constexpr Vec3f Into(const Mat3f& m, Vec3f v) { return {Dot(m.x, v), Dot(m.y, v), Dot(m.z, v)}; }
// transpose(a) * b.
constexpr Mat3f Into(const Mat3f& a, const Mat3f& b) { return {Into(a, b.x), Into(a, b.y), Into(a, b.z)}; }
constexpr Mat3f Transposed(const Mat3f& m) {
  return {{m.x.x, m.y.x, m.z.x}, {m.x.y, m.y.y, m.z.y}, {m.x.z, m.y.z, m.z.z}};
}

// The rotation of a unit quaternion, computed in doubles.
inline Mat3f RotationOf(Quatd q) {
  return {Vec3f(Rotate(q, Vec3d{1, 0, 0})), Vec3f(Rotate(q, Vec3d{0, 1, 0})), Vec3f(Rotate(q, Vec3d{0, 0, 1}))};
}

// A symmetric 3 x 3 matrix.
struct SymMat3f {
  float xx = 0, yy = 0, zz = 0, xy = 0, xz = 0, yz = 0;

  friend constexpr Vec3f operator*(const SymMat3f& m, Vec3f v) {
    return {m.xx * v.x + m.xy * v.y + m.xz * v.z, m.xy * v.x + m.yy * v.y + m.yz * v.z,
            m.xz * v.x + m.yz * v.y + m.zz * v.z};
  }
};

// r diag(d) transpose(r).
constexpr SymMat3f Turned(const Mat3f& r, Vec3f d) {
  const Vec3f x = r.x * d.x, y = r.y * d.y, z = r.z * d.z;
  return {x.x * r.x.x + y.x * r.y.x + z.x * r.z.x, x.y * r.x.y + y.y * r.y.y + z.y * r.z.y,
          x.z * r.x.z + y.z * r.y.z + z.z * r.z.z, x.x * r.x.y + y.x * r.y.y + z.x * r.z.y,
          x.x * r.x.z + y.x * r.y.z + z.x * r.z.z, x.y * r.x.z + y.y * r.y.z + z.y * r.z.z};
}

}  // namespace tessera::physics
