// Vectors, quaternions and poses, in single and double precision.
//
// Right-handed, y up, metres, radians, seconds, kilograms. Positions in world space are double (`Vec3d`); directions,
// velocities and coordinates local to a region or body may be float. Quaternions are (x, y, z, w), unit length, and
// rotate local to world: `Rotate(q, local)`.
#pragma once

#include <cmath>
#include <ostream>

namespace tessera {

template <class T>
struct Vec3 {
  T x{}, y{}, z{};

  constexpr Vec3() = default;
  constexpr Vec3(T x_in, T y_in, T z_in) : x(x_in), y(y_in), z(z_in) {}
  template <class U>
  constexpr explicit Vec3(const Vec3<U>& v) : x(static_cast<T>(v.x)), y(static_cast<T>(v.y)), z(static_cast<T>(v.z)) {}

  friend constexpr bool operator==(const Vec3&, const Vec3&) = default;
  friend constexpr Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  friend constexpr Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  friend constexpr Vec3 operator-(Vec3 a) { return {-a.x, -a.y, -a.z}; }
  friend constexpr Vec3 operator*(Vec3 a, T s) { return {a.x * s, a.y * s, a.z * s}; }
  friend constexpr Vec3 operator*(T s, Vec3 a) { return a * s; }
  friend constexpr Vec3 operator/(Vec3 a, T s) { return {a.x / s, a.y / s, a.z / s}; }
  constexpr Vec3& operator+=(Vec3 b) { return *this = *this + b; }
  constexpr Vec3& operator-=(Vec3 b) { return *this = *this - b; }
  constexpr Vec3& operator*=(T s) { return *this = *this * s; }
  friend std::ostream& operator<<(std::ostream& out, const Vec3& v) {
    return out << '(' << v.x << ", " << v.y << ", " << v.z << ')';
  }
};

struct Vec2f {
  float x = 0, y = 0;
  friend constexpr bool operator==(const Vec2f&, const Vec2f&) = default;
};

template <class T>
constexpr T Dot(Vec3<T> a, Vec3<T> b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class T>
constexpr Vec3<T> Cross(Vec3<T> a, Vec3<T> b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class T>
constexpr T LengthSquared(Vec3<T> v) {
  return Dot(v, v);
}
template <class T>
T Length(Vec3<T> v) {
  return std::sqrt(LengthSquared(v));
}
// Unit vector along v; `fallback` where v has no direction.
template <class T>
Vec3<T> Normalized(Vec3<T> v, Vec3<T> fallback = {T(0), T(1), T(0)}) {
  const T length = Length(v);
  return length > T(0) ? v / length : fallback;
}
template <class T>
bool IsFinite(Vec3<T> v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

template <class T>
struct Quat {
  T x{}, y{}, z{}, w{1};

  constexpr Quat() = default;
  constexpr Quat(T x_in, T y_in, T z_in, T w_in) : x(x_in), y(y_in), z(z_in), w(w_in) {}
  template <class U>
  constexpr explicit Quat(const Quat<U>& q)
      : x(static_cast<T>(q.x)), y(static_cast<T>(q.y)), z(static_cast<T>(q.z)), w(static_cast<T>(q.w)) {}

  friend constexpr bool operator==(const Quat&, const Quat&) = default;
  // Composition: `a * b` rotates by b first, then by a.
  friend constexpr Quat operator*(Quat a, Quat b) {
    return {a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y, a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
            a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w, a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z};
  }
  friend std::ostream& operator<<(std::ostream& out, const Quat& q) {
    return out << '(' << q.x << ", " << q.y << ", " << q.z << ", " << q.w << ')';
  }
};

template <class T>
constexpr Quat<T> Conjugate(Quat<T> q) {
  return {-q.x, -q.y, -q.z, q.w};
}
template <class T>
T Length(Quat<T> q) {
  return std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w);
}
template <class T>
Quat<T> Normalized(Quat<T> q) {
  const T length = Length(q);
  return length > T(0) ? Quat<T>(q.x / length, q.y / length, q.z / length, q.w / length) : Quat<T>();
}
template <class T>
bool IsFinite(Quat<T> q) {
  return std::isfinite(q.x) && std::isfinite(q.y) && std::isfinite(q.z) && std::isfinite(q.w);
}
template <class T>
constexpr Vec3<T> Rotate(Quat<T> q, Vec3<T> v) {
  const Vec3<T> u{q.x, q.y, q.z};
  const Vec3<T> t = T(2) * Cross(u, v);
  return v + q.w * t + Cross(u, t);
}

using Vec3d = Vec3<double>;
using Vec3f = Vec3<float>;
using Quatd = Quat<double>;
using Quatf = Quat<float>;

// A frame: local to parent is `position + Rotate(orientation, local)`.
struct Pose {
  Vec3d position;
  Quatd orientation;
  friend bool operator==(const Pose&, const Pose&) = default;
};

}  // namespace tessera
