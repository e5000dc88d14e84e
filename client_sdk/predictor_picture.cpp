// A frame is drawn between two predicted ticks, with corrections and changes of time blended: see predictor.h.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <vector>

#include "client_sdk/blend.h"
#include "client_sdk/predictor.h"

namespace tessera::client {
namespace {

// A correction fades to a third in this time: fast enough to be true soon, too slow to be seen as a jump.
constexpr double kBlend_s = 0.1;
// In which a body that is touched, or let go, comes from one time to the other.
constexpr double kChange_s = 0.15;

}  // namespace

Pose Predictor::Raw(const Body& body) const {
  return Between({body.before.position, body.before.orientation}, {body.now.position, body.now.orientation}, phase_);
}

std::vector<PredictedBody> Predictor::At(TimePoint now, double phase) {
  std::vector<PredictedBody> shown;
  if (!running()) return shown;
  // If not all inputs are simulated, the newest state is shown until the server's next one.
  phase_ = simulated_ < inputs_.size() ? 1 : std::clamp(phase, 0.0, 1.0);
  const double passed_s =
      shown_at_.has_value() ? std::max(0.0, std::chrono::duration<double>(now - *shown_at_).count()) : 0;
  shown_at_ = now;
  const double kept = std::exp(-passed_s / kBlend_s);
  const auto show = [&](BodyId id, Body& body) {
    body.offset *= kept;
    body.turn = Share(body.turn, kept);
    const bool here_alone = body.thrown && FindThrown(id) != nullptr;
    if (body.taken != Tick() && !body.touched) {
      body.weight -= passed_s / kLetGo_s;
    } else {
      body.weight += body.ahead ? passed_s / kChange_s : -passed_s / kChange_s;
    }
    body.weight = std::clamp(body.weight, 0.0, 1.0);
    if (body.weight <= 0) {
      body.thrown = false, body.taken = Tick();
      return;
    }
    const Pose raw = Raw(body);
    shown.push_back({.id = id,
                     .pose = {raw.position + body.offset, Normalized(body.turn * raw.orientation)},
                     .weight = body.weight,
                     .thrown = here_alone,
                     .velocity_m_s = body.now.linear_velocity,
                     .spin_rad_s = body.now.angular_velocity});
  };
  for (auto& [id, body] : bodies_) show(id, body);
  for (auto& [id, body] : on_paths_) show(id, body);
  std::ranges::sort(shown, {}, &PredictedBody::id);
  return shown;
}

}  // namespace tessera::client
