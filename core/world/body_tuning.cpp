#include "core/world/body_tuning.h"

#include <cmath>

#include "core/world/limits.h"

namespace tessera {
namespace {

constexpr std::uint8_t kTunesGravity = 1, kTunesFriction = 2, kTunesRestitution = 4, kTunesVisibility = 8,
                       kTunesClaim = 16;

// Written so that a NaN fails.
bool TunedWithin(const std::optional<float>& value, double least, double most) {
  return !value || (*value >= least && *value <= most);
}

bool IsOfBodies(Visibility visible_to) {
  return visible_to == Visibility::kEveryone || visible_to == Visibility::kTeam || visible_to == Visibility::kServers;
}

}  // namespace

double GravityScaleOf(const BodyDef& def, const BodyTuning& tuning) {
  return tuning.gravity_scale ? static_cast<double>(*tuning.gravity_scale) : def.gravity_scale;
}

Material MaterialOf(const BodyDef& def, const BodyTuning& tuning) {
  Material material = def.material;
  if (tuning.friction) material.friction = *tuning.friction;
  if (tuning.restitution) material.restitution = *tuning.restitution;
  return material;
}

bool IsSane(const BodyTuning& tuning) {
  return TunedWithin(tuning.gravity_scale, -kMaxTunedGravity, kMaxTunedGravity) &&
         TunedWithin(tuning.friction, 0, kMaxFriction) && TunedWithin(tuning.restitution, 0, 1) &&
         (!tuning.visible_to || IsOfBodies(*tuning.visible_to)) &&
         (!tuning.claim || (tuning.claim->player != PlayerNumber() && tuning.claim->command != 0));
}

void Write(ByteWriter& out, const BodyTuning& tuning) {
  out.U8(static_cast<std::uint8_t>((tuning.gravity_scale ? kTunesGravity : 0) | (tuning.friction ? kTunesFriction : 0) |
                                   (tuning.restitution ? kTunesRestitution : 0) |
                                   (tuning.visible_to ? kTunesVisibility : 0) | (tuning.claim ? kTunesClaim : 0)));
  for (const std::optional<float>& value : {tuning.gravity_scale, tuning.friction, tuning.restitution}) {
    if (value) out.F32(*value);
  }
  if (tuning.visible_to) out.U8(static_cast<std::uint8_t>(*tuning.visible_to));
  if (!tuning.claim) return;
  out.Varint(tuning.claim->player.value());
  out.Varint(tuning.claim->command);
}

BodyTuning ReadTuning(ByteReader& in) {
  BodyTuning tuning;
  const std::uint8_t flags = in.U8();
  if (flags > (kTunesGravity | kTunesFriction | kTunesRestitution | kTunesVisibility | kTunesClaim)) {
    in.Fail("unknown flags");
  }
  if ((flags & kTunesGravity) != 0) tuning.gravity_scale = in.F32();
  if ((flags & kTunesFriction) != 0) tuning.friction = in.F32();
  if ((flags & kTunesRestitution) != 0) tuning.restitution = in.F32();
  if ((flags & kTunesVisibility) != 0) tuning.visible_to = static_cast<Visibility>(in.U8());
  if ((flags & kTunesClaim) != 0) {
    const PlayerNumber player(in.Varint32());
    tuning.claim = SpawnClaim{player, in.Varint32()};
  }
  return tuning;
}

}  // namespace tessera
