// The little vector algebra that a picture needs: floats, relative to the camera, so that large worlds stay sharp.
#pragma once

#include <array>
#include <cmath>

namespace desktop {

struct Vec3 {
  float x = 0, y = 0, z = 0;
  friend Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  friend Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  friend Vec3 operator*(Vec3 a, float s) { return {a.x * s, a.y * s, a.z * s}; }
};

inline float Dot(Vec3 a, Vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec3 Cross(Vec3 a, Vec3 b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
inline float Length(Vec3 a) { return std::sqrt(Dot(a, a)); }
inline Vec3 Unit(Vec3 a) {
  const float length = Length(a);
  return length > 0 ? a * (1 / length) : Vec3{0, 1, 0};
}

// Where a player looks: `yaw` about +y, to the left, 0 along -z; `pitch` up.
inline Vec3 LookDirection(float yaw, float pitch) {
  return {-std::sin(yaw) * std::cos(pitch), std::sin(pitch), -std::cos(yaw) * std::cos(pitch)};
}

// Column-major, as OpenGL reads it.
using Matrix = std::array<float, 16>;

inline Matrix operator*(const Matrix& a, const Matrix& b) {
  Matrix product{};
  for (std::size_t column = 0; column < 4; ++column) {
    for (std::size_t row = 0; row < 4; ++row) {
      for (std::size_t k = 0; k < 4; ++k) product[4 * column + row] += a[4 * k + row] * b[4 * column + k];
    }
  }
  return product;
}

inline Matrix Perspective(float vertical_angle, float aspect, float near, float far) {
  const float f = 1 / std::tan(vertical_angle / 2);
  return {f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0, 2 * far * near / (near - far),
          0};
}

inline Matrix Orthographic(float half_width, float near, float far) {
  const float s = 1 / half_width;
  return {s, 0, 0, 0, 0, s, 0, 0, 0, 0, -2 / (far - near), 0, 0, 0, -(far + near) / (far - near), 1};
}

inline Matrix LookAt(Vec3 eye, Vec3 direction) {
  const Vec3 back = Unit(direction * -1);
  const Vec3 up = std::abs(back.y) > 0.999F ? Vec3{0, 0, 1} : Vec3{0, 1, 0};
  const Vec3 right = Unit(Cross(up, back)), top = Cross(back, right);
  return {right.x, top.x, back.x, 0, right.y,          top.y,          back.y,          0,
          right.z, top.z, back.z, 0, -Dot(right, eye), -Dot(top, eye), -Dot(back, eye), 1};
}

}  // namespace desktop
