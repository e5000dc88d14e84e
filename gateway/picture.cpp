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
  const std::vector<client::ShownBody> shown = client.Interpolated(now);
  Follow(client, shown);
  for (std::size_t i = 0; i < shown.size(); ++i) {
    const client::ShownBody& body = shown[i];
    const Known& known = known_[i];
    if (known.identity == nullptr) continue;
    const Vec3d origin = Rotate(body.pose.orientation, book_->OriginOf(known.shape));
    PictureBody& out = picture_.bodies.emplace_back();
    out.id = body.id;
    out.identity = known.identity.get();
    out.number = known.number;
    out.position = PackPosition(body.pose.position + origin);
    out.orientation = PackOrientation(body.pose.orientation);
    if (body.extrapolated) out.state |= kExtrapolatedState;
    if (body.predicted) out.state |= kPredictedState;
    if (body.seen == nullptr) continue;
    const BodyState& state = body.seen->state;
    out.owner = body.seen->region.value();
    out.speed = state.asleep ? 0 : PackSpeed(state.linear_velocity);
    if (state.asleep) out.state |= kAsleepState;
  }
  return picture_;
}

void PictureMaker::Follow(const client::Client& client, const std::vector<client::ShownBody>& shown) {
  const auto same_body = [](const client::ShownBody& body, const Known& known) { return body.id == known.id; };
  if (!std::ranges::equal(shown, known_, same_body)) {
    next_.clear();
    auto known = known_.begin();
    for (const client::ShownBody& body : shown) {
      while (known != known_.end() && known->id < body.id) ++known;
      if (known != known_.end() && known->id == body.id) {
        next_.push_back(std::move(*known));
      } else {
        next_.push_back({.id = body.id});
      }
    }
    known_.swap(next_);
  }
  for (Known& known : known_) {
    // A player's name comes with its body's properties, which may come later than the body.
    const bool named = known.lacks_name && !client.NameOf(known.identity->player).empty();
    if (named || known.identity == nullptr) Identify(client, known);
  }
}

void PictureMaker::Identify(const client::Client& client, Known& known) {
  const BodyDef* def = client.DefOf(known.id);
  if (def == nullptr || def->shape == nullptr) return;
  const std::uint32_t shape = book_->NumberOf(*def->shape);
  if (shape == 0) return;
  auto identity = std::make_unique<Identity>();
  identity->shape = shape;
  if (def->trigger) identity->flags |= kTriggerFlag;
  if (def->kinematic) identity->flags |= kKinematicFlag;
  identity->player = PlayerOf(known.id);
  identity->name = identity->player == PlayerNumber() ? def->name : client.NameOf(identity->player);
  identity->mass_kg = static_cast<float>(def->mass_kg);
  known = {.id = known.id,
           .number = ++last_identity_,
           .shape = shape,
           .lacks_name = identity->player != PlayerNumber() && identity->name.empty(),
           .identity = std::move(identity)};
}

}  // namespace tessera::gateway
