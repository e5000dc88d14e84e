#include "core/game/blast.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "absl/strings/str_cat.h"
#include "core/game/settings.h"

namespace tessera::game {
namespace {

constexpr std::uint8_t kBlastHasSpeed = 1;

absl::Status BadBlast(absl::string_view field) { return absl::InvalidArgumentError(absl::StrCat("blast: ", field)); }

bool BlastWithin(double value, double least, double most) { return value >= least && value <= most; }

double ShareAt(const Blast& blast, double distance) {
  const double left = std::max(0.0, 1 - distance / blast.radius_m);
  switch (blast.falloff) {
    case BlastFalloff::kNone:
      return 1;
    case BlastFalloff::kLinear:
      return left;
    case BlastFalloff::kSquare:
      return left * left;
  }
  return 0;
}

}  // namespace

std::optional<BlastHit> HitOf(const Blast& blast, Vec3d place, double mass_kg) {
  const Vec3d away = place - blast.at;
  const double distance = Length(away);
  if (!(distance <= blast.radius_m)) return std::nullopt;
  BlastHit hit{ShareAt(blast, distance), {}};
  const Vec3d up{0, 1, 0};
  Vec3d way = distance > 0 ? away / distance + up * blast.lift : up;
  const double length = Length(way);
  way = length > 0 ? way / length : up;  // straight down, with as much lift
  const double most = mass_kg * std::min(blast.speed_m_s.value_or(kMaxGameSpeed_m_s), kMaxGameSpeed_m_s);
  hit.impulse_ns = way * (std::clamp(blast.impulse_ns, -most, most) * hit.share);
  return hit;
}

void Write(ByteWriter& out, const Blast& blast) {
  out.Varint(blast.id);
  out.Varint(blast.due.value());
  out.Varint(blast.ends.value());
  out.Varint(blast.by.value());
  out.V(blast.at);
  out.F64(blast.radius_m);
  out.F64(blast.impulse_ns);
  out.U8(blast.speed_m_s ? kBlastHasSpeed : std::uint8_t{0});
  if (blast.speed_m_s) out.F64(*blast.speed_m_s);
  out.F64(blast.lift);
  out.U8(static_cast<std::uint8_t>(blast.falloff));
  out.Varint(blast.layers);
  out.Block(std::string_view(blast.name));
}

void ReadBlast(ByteReader& in, Blast& blast) {
  blast.id = in.Varint();
  blast.due = Tick(in.Varint());
  blast.ends = Tick(in.Varint());
  blast.by = BodyId(in.Varint());
  blast.at = in.V3d();
  blast.radius_m = in.F64();
  blast.impulse_ns = in.F64();
  const std::uint8_t flags = in.U8();
  if (flags > kBlastHasSpeed) in.Fail("a blast with unknown flags");
  if ((flags & kBlastHasSpeed) != 0) blast.speed_m_s = in.F64();
  blast.lift = in.F64();
  blast.falloff = static_cast<BlastFalloff>(in.U8());
  blast.layers = in.Varint32();
  const auto name = in.Block(kMaxBlastNameBytes);
  blast.name.assign(name.begin(), name.end());
}

absl::Status CheckBlast(const Blast& blast) {
  if (blast.id == 0) return BadBlast("id");
  if (blast.ends < blast.due) return BadBlast("ends");
  if (!IsFinite(blast.at)) return BadBlast("at");
  if (!BlastWithin(blast.radius_m, 1e-3, kMaxBlastRadius_m)) return BadBlast("radius");
  if (!BlastWithin(blast.impulse_ns, -kMaxBlastImpulse_ns, kMaxBlastImpulse_ns)) return BadBlast("impulse");
  if (blast.speed_m_s && !BlastWithin(*blast.speed_m_s, 0, kMaxGameSpeed_m_s)) return BadBlast("speed");
  if (!BlastWithin(blast.lift, 0, 1)) return BadBlast("lift");
  if (blast.falloff > BlastFalloff::kSquare) return BadBlast("falloff");
  return absl::OkStatus();
}

void Write(ByteWriter& out, const std::vector<BlastMark>& marks) {
  out.Varint(marks.size());
  for (const BlastMark& mark : marks) {
    out.Varint(mark.id);
    out.Varint(mark.ends.value());
  }
}

void ReadBlastMarks(ByteReader& in, std::vector<BlastMark>& marks) {
  marks.resize(in.Count(2));
  for (BlastMark& mark : marks) {
    mark.id = in.Varint();
    mark.ends = Tick(in.Varint());
  }
}

absl::Status CheckBlastMarks(const std::vector<BlastMark>& marks) {
  if (!std::ranges::is_sorted(marks, std::less_equal<>(), &BlastMark::id)) {
    return absl::InvalidArgumentError("blasts: out of order");
  }
  return absl::OkStatus();
}

}  // namespace tessera::game
