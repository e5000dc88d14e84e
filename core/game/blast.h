// Blast: an area effect that a game asked for: once, all bodies around a place are pushed away from it.
//
// It names a tick, so that all regions that it reaches act on the same states. A region that hears of it later acts
// then. On each body it acts once, or never: that is settled for a body when a region that knows the blast and owns the
// body has gone through it. A body that goes to another region takes along which blasts are settled for it (BlastMark).
//
// Thread rule: plain values and free functions.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "core/world/bytes.h"
#include "core/world/ids.h"
#include "core/world/math.h"
#include "core/world/scene.h"

namespace tessera::game {

enum class BlastFalloff : std::uint8_t {
  kNone,    // the same everywhere
  kLinear,  // to nothing at the radius
  kSquare,  // the same, squared
};

struct Blast {
  std::uint64_t id = 0;  // no other has it
  Tick due;              // it acts after the step to this tick
  Tick ends;             // whoever hears of it after this tick does nothing
  BodyId by;             // the body whose callback asked for it; 0: the world
  Vec3d at;
  double radius_m = 1;
  double impulse_ns = 0;            // where nothing has fallen off, away from `at`; below 0: towards it
  std::optional<double> speed_m_s;  // a body gets no faster than this by it; it falls off, too
  double lift = 0;                  // share of a way up that the way away from `at` gets
  BlastFalloff falloff = BlastFalloff::kLinear;
  std::uint32_t layers = ~0u;  // bit i: bodies of the scene's layer i
  std::string name;            // that on_blast is told; it may be empty
  friend bool operator==(const Blast&, const Blast&) = default;
};

// So long after its tick a blast is kept, for bodies and regions that were cut off.
inline constexpr std::uint64_t kBlastLife_s = 10;
// That a region keeps at once. Each body that it hands over names those that are settled.
inline constexpr std::size_t kMaxBlasts = 256;
inline constexpr double kMaxBlastRadius_m = 200;
inline constexpr double kMaxBlastImpulse_ns = 1e9;
inline constexpr std::size_t kMaxBlastNameBytes = 32;

struct BlastHit {
  double share = 0;  // 1 where nothing has fallen off
  Vec3d impulse_ns;
};
// The push on a body with its centre of mass at `place`; nothing beyond the radius. The place itself is pushed up.
std::optional<BlastHit> HitOf(const Blast& blast, Vec3d place, double mass_kg);

// A blast that is settled for a body.
struct BlastMark {
  std::uint64_t id = 0;
  Tick ends;  // the mark is not needed after this tick
  friend auto operator<=>(const BlastMark&, const BlastMark&) = default;
};

inline constexpr std::size_t kMinBlastBytes = 56;
void Write(ByteWriter& out, const Blast& blast);
// Leaves a failed reader, or a blast that CheckBlast refuses, where the bytes are not sound.
void ReadBlast(ByteReader& in, Blast& blast);
// INVALID_ARGUMENT: "blast: radius" and so on.
absl::Status CheckBlast(const Blast& blast);

void Write(ByteWriter& out, const std::vector<BlastMark>& marks);
void ReadBlastMarks(ByteReader& in, std::vector<BlastMark>& marks);
// INVALID_ARGUMENT: "blasts: out of order".
absl::Status CheckBlastMarks(const std::vector<BlastMark>& marks);

}  // namespace tessera::game
