// Wide arithmetic: eight floats at a time, as one AVX register or two of SSE, with the same bits. It is for
// kernel_*.cpp only: everything here has internal linkage, so that each translation unit keeps its own instructions.
#pragma once

#include <immintrin.h>

#include "core/physics/solve/kernel.h"

#define TESSERA_INLINE inline __attribute__((always_inline))
// Before a loop over the points of a contact: only then do its arrays become registers. GCC by itself leaves such
// loops.
#define TESSERA_UNROLL _Pragma("GCC unroll 4")

namespace tessera::physics {
namespace {

#ifdef __AVX2__
struct F {
  __m256 v;
};
TESSERA_INLINE F Wide(float x) { return {_mm256_set1_ps(x)}; }
TESSERA_INLINE F Load(const Lanes& x) { return {_mm256_load_ps(x.f)}; }
TESSERA_INLINE void Store(Lanes& to, F x) { _mm256_store_ps(to.f, x.v); }
TESSERA_INLINE F operator+(F a, F b) { return {_mm256_add_ps(a.v, b.v)}; }
TESSERA_INLINE F operator-(F a, F b) { return {_mm256_sub_ps(a.v, b.v)}; }
TESSERA_INLINE F operator*(F a, F b) { return {_mm256_mul_ps(a.v, b.v)}; }
TESSERA_INLINE F operator/(F a, F b) { return {_mm256_div_ps(a.v, b.v)}; }
TESSERA_INLINE F Max(F a, F b) { return {_mm256_max_ps(a.v, b.v)}; }
TESSERA_INLINE F Min(F a, F b) { return {_mm256_min_ps(a.v, b.v)}; }
TESSERA_INLINE F Sqrt(F a) { return {_mm256_sqrt_ps(a.v)}; }
TESSERA_INLINE F Positive(F a) { return {_mm256_cmp_ps(a.v, _mm256_setzero_ps(), _CMP_GT_OQ)}; }
TESSERA_INLINE F Select(F mask, F yes, F no) {
  return {_mm256_or_ps(_mm256_and_ps(mask.v, yes.v), _mm256_andnot_ps(mask.v, no.v))};
}
TESSERA_INLINE F And(F mask, F x) { return {_mm256_and_ps(mask.v, x.v)}; }
TESSERA_INLINE int Bits(F mask) { return _mm256_movemask_ps(mask.v); }
TESSERA_INLINE F Not(F mask) { return {_mm256_andnot_ps(mask.v, _mm256_castsi256_ps(_mm256_set1_epi32(-1)))}; }
TESSERA_INLINE F SignOf(F x) { return {_mm256_or_ps(_mm256_and_ps(x.v, _mm256_set1_ps(-0.0f)), _mm256_set1_ps(1.0f))}; }
#else
struct F {
  __m128 lo, hi;
};
TESSERA_INLINE F Wide(float x) { return {_mm_set1_ps(x), _mm_set1_ps(x)}; }
TESSERA_INLINE F Load(const Lanes& x) { return {_mm_load_ps(x.f), _mm_load_ps(x.f + 4)}; }
TESSERA_INLINE void Store(Lanes& to, F x) {
  _mm_store_ps(to.f, x.lo);
  _mm_store_ps(to.f + 4, x.hi);
}
TESSERA_INLINE F operator+(F a, F b) { return {_mm_add_ps(a.lo, b.lo), _mm_add_ps(a.hi, b.hi)}; }
TESSERA_INLINE F operator-(F a, F b) { return {_mm_sub_ps(a.lo, b.lo), _mm_sub_ps(a.hi, b.hi)}; }
TESSERA_INLINE F operator*(F a, F b) { return {_mm_mul_ps(a.lo, b.lo), _mm_mul_ps(a.hi, b.hi)}; }
TESSERA_INLINE F operator/(F a, F b) { return {_mm_div_ps(a.lo, b.lo), _mm_div_ps(a.hi, b.hi)}; }
TESSERA_INLINE F Max(F a, F b) { return {_mm_max_ps(a.lo, b.lo), _mm_max_ps(a.hi, b.hi)}; }
TESSERA_INLINE F Min(F a, F b) { return {_mm_min_ps(a.lo, b.lo), _mm_min_ps(a.hi, b.hi)}; }
TESSERA_INLINE F Sqrt(F a) { return {_mm_sqrt_ps(a.lo), _mm_sqrt_ps(a.hi)}; }
TESSERA_INLINE F Positive(F a) { return {_mm_cmpgt_ps(a.lo, _mm_setzero_ps()), _mm_cmpgt_ps(a.hi, _mm_setzero_ps())}; }
TESSERA_INLINE F And(F mask, F x) { return {_mm_and_ps(mask.lo, x.lo), _mm_and_ps(mask.hi, x.hi)}; }
TESSERA_INLINE F Select(F mask, F yes, F no) {
  return {_mm_or_ps(_mm_and_ps(mask.lo, yes.lo), _mm_andnot_ps(mask.lo, no.lo)),
          _mm_or_ps(_mm_and_ps(mask.hi, yes.hi), _mm_andnot_ps(mask.hi, no.hi))};
}
TESSERA_INLINE int Bits(F mask) { return _mm_movemask_ps(mask.lo) | _mm_movemask_ps(mask.hi) << 4; }
TESSERA_INLINE F Not(F mask) {
  const __m128 ones = _mm_castsi128_ps(_mm_set1_epi32(-1));
  return {_mm_andnot_ps(mask.lo, ones), _mm_andnot_ps(mask.hi, ones)};
}
TESSERA_INLINE F SignOf(F x) {
  const __m128 sign = _mm_set1_ps(-0.0f), one = _mm_set1_ps(1.0f);
  return {_mm_or_ps(_mm_and_ps(x.lo, sign), one), _mm_or_ps(_mm_and_ps(x.hi, sign), one)};
}
#endif

// Three-vectors, one to a lane.
struct V {
  F x, y, z;
};
TESSERA_INLINE V Load(const Lanes (&v)[3]) { return {Load(v[0]), Load(v[1]), Load(v[2])}; }
TESSERA_INLINE void Store(Lanes (&to)[3], V v) {
  Store(to[0], v.x);
  Store(to[1], v.y);
  Store(to[2], v.z);
}
TESSERA_INLINE V operator+(V a, V b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
TESSERA_INLINE V operator-(V a, V b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
TESSERA_INLINE V operator*(V a, F s) { return {a.x * s, a.y * s, a.z * s}; }
TESSERA_INLINE V And(F mask, V v) { return {And(mask, v.x), And(mask, v.y), And(mask, v.z)}; }
TESSERA_INLINE F Dot(V a, V b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
TESSERA_INLINE V Cross(V a, V b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }

// Transposes rows x, y, z, w of four bodies in each half to one register a component, and back.
#ifdef __AVX2__
TESSERA_INLINE void Transpose(F* r) {
  const __m256 t0 = _mm256_unpacklo_ps(r[0].v, r[1].v), t1 = _mm256_unpackhi_ps(r[0].v, r[1].v);
  const __m256 t2 = _mm256_unpacklo_ps(r[2].v, r[3].v), t3 = _mm256_unpackhi_ps(r[2].v, r[3].v);
  r[0].v = _mm256_shuffle_ps(t0, t2, 0x44);
  r[1].v = _mm256_shuffle_ps(t0, t2, 0xee);
  r[2].v = _mm256_shuffle_ps(t1, t3, 0x44);
  r[3].v = _mm256_shuffle_ps(t1, t3, 0xee);
}
TESSERA_INLINE F LoadHalves(const float* lo, const float* hi) {
  return {_mm256_insertf128_ps(_mm256_castps128_ps256(_mm_load_ps(lo)), _mm_load_ps(hi), 1)};
}
TESSERA_INLINE void StoreHalves(float* lo, float* hi, F x) {
  _mm_store_ps(lo, _mm256_castps256_ps128(x.v));
  _mm_store_ps(hi, _mm256_extractf128_ps(x.v, 1));
}
#else
TESSERA_INLINE void Transpose(F* r) {
  _MM_TRANSPOSE4_PS(r[0].lo, r[1].lo, r[2].lo, r[3].lo);
  _MM_TRANSPOSE4_PS(r[0].hi, r[1].hi, r[2].hi, r[3].hi);
}
TESSERA_INLINE F LoadHalves(const float* lo, const float* hi) { return {_mm_load_ps(lo), _mm_load_ps(hi)}; }
TESSERA_INLINE void StoreHalves(float* lo, float* hi, F x) {
  _mm_store_ps(lo, x.lo);
  _mm_store_ps(hi, x.hi);
}
#endif

struct Motion {
  V v, w;
};

// The state or mass of the body that a contact names (see kStateUnits).
template <class Part>
TESSERA_INLINE Part& PartOf(Part* parts, std::int32_t body) {
  using Byte = std::conditional_t<std::is_const_v<Part>, const char, char>;
  constexpr std::ptrdiff_t kUnit = sizeof(Part) / kStateUnits;
  return *reinterpret_cast<Part*>(reinterpret_cast<Byte*>(parts) + std::ptrdiff_t{body} * kUnit);
}

// The two vectors of four floats that start at `member`, for the bodies that `index` names.
TESSERA_INLINE Motion Gather(const SolvedState* bodies, const std::int32_t* index, const float (SolvedState::*first)[4],
                             const float (SolvedState::*second)[4]) {
  F v[4], w[4];
  for (int i = 0; i < 4; ++i) {
    const SolvedState& lo = PartOf(bodies, index[i]);
    const SolvedState& hi = PartOf(bodies, index[i + 4]);
    v[i] = LoadHalves(lo.*first, hi.*first);
    w[i] = LoadHalves(lo.*second, hi.*second);
  }
  Transpose(v);
  Transpose(w);
  return {{v[0], v[1], v[2]}, {w[0], w[1], w[2]}};
}

TESSERA_INLINE Motion GatherVelocity(const SolvedState* bodies, const std::int32_t* index) {
  return Gather(bodies, index, &SolvedState::velocity, &SolvedState::spin);
}
TESSERA_INLINE Motion GatherMoved(const SolvedState* bodies, const std::int32_t* index) {
  return Gather(bodies, index, &SolvedState::moved, &SolvedState::turned);
}
TESSERA_INLINE void ScatterVelocity(SolvedState* bodies, const std::int32_t* index, Motion m) {
  F v[4] = {m.v.x, m.v.y, m.v.z, Wide(0)}, w[4] = {m.w.x, m.w.y, m.w.z, Wide(0)};
  Transpose(v);
  Transpose(w);
  for (int i = 0; i < 4; ++i) {
    SolvedState& lo = PartOf(bodies, index[i]);
    SolvedState& hi = PartOf(bodies, index[i + 4]);
    StoreHalves(lo.velocity, hi.velocity, v[i]);
    StoreHalves(lo.spin, hi.spin, w[i]);
  }
}

// Inverse square roots of the inertia and of the mass.
struct MassOf {
  F xx, yy, zz, xy, xz, yz, inverse_root_mass;
};
TESSERA_INLINE MassOf GatherMass(const SolvedMass* masses, const std::int32_t* index) {
  F p[4], q[4];
  for (int i = 0; i < 4; ++i) {
    const SolvedMass& lo = PartOf(masses, index[i]);
    const SolvedMass& hi = PartOf(masses, index[i + 4]);
    p[i] = LoadHalves(lo.root_inertia, hi.root_inertia);
    q[i] = LoadHalves(lo.root_inertia + 4, hi.root_inertia + 4);
  }
  Transpose(p);
  Transpose(q);
  return {p[0], p[1], p[2], p[3], q[0], q[1], q[2]};
}
TESSERA_INLINE V operator*(const MassOf& m, V v) {
  return {m.xx * v.x + m.xy * v.y + m.xz * v.z, m.xy * v.x + m.yy * v.y + m.yz * v.z,
          m.xz * v.x + m.yz * v.y + m.zz * v.z};
}

}  // namespace
}  // namespace tessera::physics
