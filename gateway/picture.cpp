#include "gateway/picture.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "gateway/viewer_format.h"

namespace tessera::gateway {
namespace {

// To the nearest integer, halves away from zero, as std::llround does but by a call of the library for each number, of
// which a picture has seven a body.
std::int64_t ToNearest(double value) { return static_cast<std::int64_t>(value + std::copysign(0.5, value)); }

}  // namespace

std::uint32_t PackOrientation(const Quatd& q) {
  const std::array<double, 4> parts{q.x, q.y, q.z, q.w};
  std::size_t largest = 3;
  for (std::size_t i = 0; i < 3; ++i) {
    if (std::abs(parts[i]) > std::abs(parts[largest])) largest = i;
  }
  const double sign = parts[largest] < 0 ? -1 : 1;
  auto packed = static_cast<std::uint32_t>(largest) << 30;
  int shift = 20;
  for (std::size_t i = 0; i < 4; ++i) {
    if (i == largest) continue;
    const double share = sign * parts[i] / std::numbers::sqrt2 + 0.5;
    packed |= static_cast<std::uint32_t>(ToNearest(std::clamp(share, 0.0, 1.0) * 1023)) << shift;
    shift -= 10;
  }
  return packed;
}

std::array<std::int64_t, 3> PackPosition(const Vec3d& p) {
  return {ToNearest(p.x * kPositionSteps_per_m), ToNearest(p.y * kPositionSteps_per_m),
          ToNearest(p.z * kPositionSteps_per_m)};
}

std::uint32_t PackSpeed(const Vec3f& velocity) {
  return static_cast<std::uint32_t>(ToNearest(Length(Vec3d(velocity)) * kSpeedSteps_per_m_s));
}

const Picture& PictureMaker::Make(client::Client& client, client::TimePoint now, client::TimePoint taken_at,
                                  bool paused) {
  picture_.tick = client.tick();
  picture_.time_s = std::chrono::duration<double>(taken_at.time_since_epoch()).count();
  picture_.paused = paused;
  picture_.bodies.clear();
  next_.clear();
  const std::vector<client::ShownBody> shown = client.Interpolated(now);
  const std::map<BodyId, client::SeenBody>& world = client.World();
  auto known = known_.begin();
  auto seen = world.begin();
  for (const client::ShownBody& body : shown) {
    while (known != known_.end() && known->id < body.id) ++known;
    while (seen != world.end() && seen->first < body.id) ++seen;
    const bool is_known = known != known_.end() && known->id == body.id && !NameHasCome(client, *known);
    std::unique_ptr<const Identity> identity = is_known ? std::move(known->identity) : Identify(client, body.id);
    if (identity == nullptr) continue;  // no shape of the scene
    const Vec3d origin = Rotate(body.pose.orientation, book_->OriginOf(identity->shape));
    PictureBody& out = picture_.bodies.emplace_back();
    out.id = body.id;
    out.identity = identity.get();
    out.position = PackPosition(body.pose.position + origin);
    out.orientation = PackOrientation(body.pose.orientation);
    if (body.extrapolated) out.state |= kExtrapolatedState;
    if (body.predicted) out.state |= kPredictedState;
    if (seen != world.end() && seen->first == body.id) {
      out.owner = seen->second.region.value();
      out.speed = seen->second.state.asleep ? 0 : PackSpeed(seen->second.state.linear_velocity);
      if (seen->second.state.asleep) out.state |= kAsleepState;
    }
    next_.push_back({body.id, std::move(identity)});
  }
  known_.swap(next_);
  return picture_;
}

// A player's name comes with its body's properties, which may come later than the body.
bool PictureMaker::NameHasCome(const client::Client& client, const Known& known) const {
  const Identity& identity = *known.identity;
  return identity.player != PlayerNumber() && identity.name.empty() && !client.NameOf(identity.player).empty();
}

std::unique_ptr<const Identity> PictureMaker::Identify(const client::Client& client, BodyId id) {
  const BodyDef* def = client.DefOf(id);
  if (def == nullptr || def->shape == nullptr) return nullptr;
  auto identity = std::make_unique<Identity>();
  identity->number = ++last_identity_;
  identity->shape = book_->NumberOf(*def->shape);
  if (identity->shape == 0) return nullptr;
  if (def->trigger) identity->flags |= kTriggerFlag;
  if (def->kinematic) identity->flags |= kKinematicFlag;
  identity->player = PlayerOf(id);
  identity->name = identity->player == PlayerNumber() ? def->name : client.NameOf(identity->player);
  identity->mass_kg = static_cast<float>(def->mass_kg);
  return identity;
}

}  // namespace tessera::gateway
