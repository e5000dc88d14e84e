#include "core/world/state_check.h"

#include <cmath>

#include "absl/strings/str_cat.h"
#include "core/world/limits.h"

namespace tessera {
namespace {

// All are written so that a NaN fails. This one has no branches, which would cost more than they spare.
template <class T>
bool Within(Vec3<T> v, double limit) {
  const auto within = [limit](T c) { return std::abs(static_cast<double>(c)) <= limit; };
  return static_cast<bool>(static_cast<int>(within(v.x)) & static_cast<int>(within(v.y)) &
                           static_cast<int>(within(v.z)));
}

bool UnitWithin(Quatd q) { return std::abs(Length(q) - 1) <= kUnitTolerance; }

bool Waited(float seconds) { return std::isfinite(seconds) && seconds >= 0; }

absl::Status Fault(BodyId id, const std::string& field, const std::string& problem, double value) {
  const bool finite = std::isfinite(value);
  const std::string got = std::isnan(value) ? "nan" : finite ? absl::StrCat(value) : value > 0 ? "inf" : "-inf";
  return absl::InvalidArgumentError(absl::StrCat("body ", id.value(), ": ", field, " must be ",
                                                 finite ? problem : std::string("a finite number"), ", got ", got));
}

// Names the component of the vector that is not within `limit`.
template <class T>
absl::Status Blame(BodyId id, const char* field, Vec3<T> v, double limit) {
  const char* names[] = {".x", ".y", ".z"};
  const double values[] = {static_cast<double>(v.x), static_cast<double>(v.y), static_cast<double>(v.z)};
  int worst = 2;
  if (!(std::abs(values[1]) <= limit)) worst = 1;
  if (!(std::abs(values[0]) <= limit)) worst = 0;
  return Fault(id, absl::StrCat(field, names[worst]), absl::StrCat(-limit, " to ", limit), values[worst]);
}

}  // namespace

bool IsSane(const BodyState& state) {
  return Within(state.position, kMaxStatePosition_m) && UnitWithin(state.orientation) &&
         Within(state.linear_velocity, kMaxStateSpeed_m_s) &&
         Within(state.angular_velocity, kMaxStateAngularSpeed_rad_s) &&
         Within(state.angular_momentum, kMaxStateAngularMomentum) && Waited(state.still_s);
}

absl::Status CheckState(BodyId id, const BodyState& state) {
  if (!Within(state.position, kMaxStatePosition_m)) return Blame(id, "position", state.position, kMaxStatePosition_m);
  if (!UnitWithin(state.orientation)) return Fault(id, "orientation", "of length 1", Length(state.orientation));
  if (!Within(state.linear_velocity, kMaxStateSpeed_m_s)) {
    return Blame(id, "linear_velocity", state.linear_velocity, kMaxStateSpeed_m_s);
  }
  if (!Within(state.angular_velocity, kMaxStateAngularSpeed_rad_s)) {
    return Blame(id, "angular_velocity", state.angular_velocity, kMaxStateAngularSpeed_rad_s);
  }
  if (!Within(state.angular_momentum, kMaxStateAngularMomentum)) {
    return Blame(id, "angular_momentum", state.angular_momentum, kMaxStateAngularMomentum);
  }
  if (!Waited(state.still_s)) return Fault(id, "still_s", ">= 0", static_cast<double>(state.still_s));
  return absl::OkStatus();
}

absl::Status CheckForce(BodyId id, Vec3f force_n, Vec3f torque_nm) {
  if (!Within(force_n, kMaxForce)) return Blame(id, "force_n", force_n, kMaxForce);
  if (!Within(torque_nm, kMaxForce)) return Blame(id, "torque_nm", torque_nm, kMaxForce);
  return absl::OkStatus();
}

bool IsSaneImpulse(Vec3f impulse_ns) { return Within(impulse_ns, kMaxImpulse); }
bool IsSaneAngularImpulse(Vec3f impulse_nms) { return Within(impulse_nms, kMaxAngularImpulse); }

}  // namespace tessera
