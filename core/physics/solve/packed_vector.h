// PackedVector: a vector of three floats in one SSE register, for passes that take bodies one by one. Each operation
// does to each part what Vec3f does, in the same order, so it gives the same bits. What the fourth part holds means
// nothing.
//
// Thread rule: plain value.
#pragma once

#include <emmintrin.h>

#include "core/physics/linear.h"

namespace tessera::physics {

struct PackedVector {
  __m128 v = _mm_setzero_ps();

  // Reads four floats: one more must follow those of `from` in the same object.
  static PackedVector Load(const Vec3f& from) { return {_mm_loadu_ps(&from.x)}; }
  static PackedVector Load(const float (&from)[4]) { return {_mm_loadu_ps(from)}; }
  static PackedVector Of(Vec3f from) { return {_mm_setr_ps(from.x, from.y, from.z, 0)}; }
  // Writes four floats, the last of which is to be written anew.
  void StoreOver(Vec3f& to) const { _mm_storeu_ps(&to.x, v); }
  // Adds the first three.
  void AddTo(float (&to)[4]) const {
    const __m128 three = _mm_castsi128_ps(_mm_setr_epi32(-1, -1, -1, 0));
    _mm_storeu_ps(to, _mm_add_ps(_mm_loadu_ps(to), _mm_and_ps(v, three)));
  }
  Vec3f Get() const {
    alignas(16) float f[4];
    _mm_store_ps(f, v);
    return {f[0], f[1], f[2]};
  }

  // Parts y, z, x and z, x, y.
  PackedVector Next() const { return {_mm_shuffle_ps(v, v, _MM_SHUFFLE(3, 0, 2, 1))}; }
  PackedVector AfterNext() const { return {_mm_shuffle_ps(v, v, _MM_SHUFFLE(3, 1, 0, 2))}; }

  friend PackedVector operator+(PackedVector a, PackedVector b) { return {_mm_add_ps(a.v, b.v)}; }
  friend PackedVector operator-(PackedVector a, PackedVector b) { return {_mm_sub_ps(a.v, b.v)}; }
  friend PackedVector operator-(PackedVector a) { return {_mm_xor_ps(a.v, _mm_set1_ps(-0.0f))}; }
  friend PackedVector operator*(PackedVector a, float s) { return {_mm_mul_ps(a.v, _mm_set1_ps(s))}; }
};

inline PackedVector Cross(PackedVector a, PackedVector b) {
  return {_mm_sub_ps(_mm_mul_ps(a.Next().v, b.AfterNext().v), _mm_mul_ps(a.AfterNext().v, b.Next().v))};
}

// Four dot products at a time: a[i] . b[i].
inline __m128 Dots(const PackedVector (&a)[4], const PackedVector (&b)[4]) {
  __m128 p = _mm_mul_ps(a[0].v, b[0].v), q = _mm_mul_ps(a[1].v, b[1].v);
  __m128 r = _mm_mul_ps(a[2].v, b[2].v), s = _mm_mul_ps(a[3].v, b[3].v);
  // Only the first three of the transposed rows are needed.
  const __m128 low_pq = _mm_unpacklo_ps(p, q), low_rs = _mm_unpacklo_ps(r, s);
  const __m128 high_pq = _mm_unpackhi_ps(p, q), high_rs = _mm_unpackhi_ps(r, s);
  const __m128 x = _mm_movelh_ps(low_pq, low_rs), y = _mm_movehl_ps(low_rs, low_pq);
  const __m128 z = _mm_movelh_ps(high_pq, high_rs);
  return _mm_add_ps(_mm_add_ps(x, y), z);
}

// A symmetric matrix by its columns.
struct PackedMatrix {
  // From xx, yy, zz, xy, xz, yz, after which two more floats must follow.
  explicit PackedMatrix(const float (&m)[6]) {
    const __m128 first = _mm_loadu_ps(m), second = _mm_loadu_ps(m + 4);
    x.v = _mm_shuffle_ps(first, second, _MM_SHUFFLE(3, 0, 3, 0));
    y.v = _mm_shuffle_ps(first, second, _MM_SHUFFLE(3, 1, 1, 3));
    z.v = _mm_shuffle_ps(second, first, _MM_SHUFFLE(3, 2, 1, 0));
  }
  PackedVector x, y, z;
  friend PackedVector operator*(const PackedMatrix& m, PackedVector by) {
    const __m128 b = by.v;
    const __m128 first = _mm_mul_ps(m.x.v, _mm_shuffle_ps(b, b, _MM_SHUFFLE(0, 0, 0, 0)));
    const __m128 second = _mm_mul_ps(m.y.v, _mm_shuffle_ps(b, b, _MM_SHUFFLE(1, 1, 1, 1)));
    const __m128 third = _mm_mul_ps(m.z.v, _mm_shuffle_ps(b, b, _MM_SHUFFLE(2, 2, 2, 2)));
    return {_mm_add_ps(_mm_add_ps(first, second), third)};
  }
};

}  // namespace tessera::physics
