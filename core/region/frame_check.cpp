#include "core/region/frame_check.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "core/region/settings.h"
#include "core/world/limits.h"

namespace tessera::region {
namespace {

absl::Status Bad(BodyId id, const char* what) {
  return absl::InvalidArgumentError(absl::StrCat("body ", id.value(), what));
}

absl::Status CheckKnown(BodyId id, const Catalog& catalog) {
  return catalog.Known(id) ? absl::OkStatus() : Bad(id, " is not a dynamic body of the scene");
}

absl::Status CheckState(BodyId id, const BodyState& state) {
  return IsSane(state) ? absl::OkStatus() : Bad(id, ": state is not finite or beyond limits");
}

absl::Status CheckControl(BodyId id, const PlayerControl& control) {
  if (!IsFinite(control.force_n) || !IsFinite(control.torque_nm)) return Bad(id, ": input is not finite");
  if (control.queue.size() > kMaxGrantedInputs) return Bad(id, ": too many queued inputs");
  std::uint32_t last = std::max(control.last_input, control.committed ? control.committed_number : 0);
  for (const QueuedInput& input : control.queue) {
    if (input.number <= last) return Bad(id, ": input numbers do not ascend");
    if (!IsFinite(input.force_n) || !IsFinite(input.torque_nm)) return Bad(id, ": input is not finite");
    last = input.number;
  }
  return absl::OkStatus();
}

absl::Status CheckGrant(const Grant& grant, const Catalog& catalog) {
  if (grant.bodies.empty()) return absl::InvalidArgumentError("a grant without bodies");
  BodyId last;
  for (const GrantedBody& body : grant.bodies) {
    if (absl::Status known = CheckKnown(body.id, catalog); !known.ok()) return known;
    if (absl::Status state = CheckState(body.id, body.state); !state.ok()) return state;
    if (body.id <= last) return Bad(body.id, ": granted bodies do not ascend");
    if (body.epoch.value() < 2) return Bad(body.id, ": a grant's epoch is at least 2");
    last = body.id;
  }
  const std::span<const BodyId> assembly = catalog.AssemblyOf(grant.bodies[0].id);
  for (const GrantedBody& body : grant.bodies) {
    if (!std::binary_search(assembly.begin(), assembly.end(), body.id)) return Bad(body.id, " is not of the assembly");
  }
  return CheckControl(grant.bodies[0].id, grant.control);
}

bool Shown(const Frame& frame, BodyId id) {
  const auto before = [](const GhostRecord& ghost, BodyId wanted) { return ghost.id < wanted; };
  const auto it = std::lower_bound(frame.ghosts.begin(), frame.ghosts.end(), id, before);
  return it != frame.ghosts.end() && it->id == id;
}

}  // namespace

bool IsSane(const BodyState& state) {
  // Written so that a NaN fails.
  const auto within = [](auto v, auto limit) {
    return std::abs(v.x) <= limit && std::abs(v.y) <= limit && std::abs(v.z) <= limit;
  };
  return within(state.position, kMaxStatePosition_m) && within(state.linear_velocity, kMaxStateSpeed_m_s) &&
         within(state.angular_velocity, kMaxStateAngularSpeed_rad_s) && IsFinite(state.angular_momentum) &&
         std::isfinite(state.still_s) && state.still_s >= 0 &&
         std::abs(Length(state.orientation) - 1) <= kUnitTolerance;
}

absl::Status CheckFrame(const Frame& frame, const Catalog& catalog) {
  for (const GhostRecord& ghost : frame.ghosts) {
    if (absl::Status known = CheckKnown(ghost.id, catalog); !known.ok()) return known;
    if (absl::Status state = CheckState(ghost.id, ghost.state); !state.ok()) return state;
    if (ghost.epoch.value() == 0) return Bad(ghost.id, ": epoch 0");
    if (!IsFinite(ghost.force_n) || !IsFinite(ghost.torque_nm)) return Bad(ghost.id, ": force is not finite");
  }
  std::pair<BodyId, BodyId> last;
  for (const ImpulseRecord& record : frame.impulses) {
    if (absl::Status known = CheckKnown(record.own, catalog); !known.ok()) return known;
    if (absl::Status known = CheckKnown(record.other, catalog); !known.ok()) return known;
    if (record.own == record.other) return Bad(record.own, " touches itself");
    if (std::pair(record.own, record.other) <= last) return Bad(record.own, ": impulses do not ascend");
    last = {record.own, record.other};
    if (!IsFinite(record.impulse_on_own) || !IsFinite(record.angular_on_own) || !IsFinite(record.angular_on_other)) {
      return Bad(record.own, ": impulse is not finite");
    }
  }
  std::vector<BodyId> granted;
  for (const Grant& grant : frame.grants) {
    if (absl::Status status = CheckGrant(grant, catalog); !status.ok()) return status;
    for (const GrantedBody& body : grant.bodies) {
      if (Shown(frame, body.id)) return Bad(body.id, " is granted and shown");
      granted.push_back(body.id);
    }
  }
  std::sort(granted.begin(), granted.end());
  const auto twice = std::adjacent_find(granted.begin(), granted.end());
  if (twice != granted.end()) return Bad(*twice, " is granted twice");
  for (const LateCorrection& late : frame.late_corrections) {
    if (!IsFinite(late.impulse_ns) || !IsFinite(late.angular_nms)) return Bad(late.id, ": correction is not finite");
  }
  for (const ForwardedInput& forwarded : frame.inputs) {
    if (!IsPlayerBody(forwarded.body)) return Bad(forwarded.body, " is no player's");
    if (!IsFinite(forwarded.input.force_n) || !IsFinite(forwarded.input.torque_nm)) {
      return Bad(forwarded.body, ": input is not finite");
    }
  }
  return absl::OkStatus();
}

}  // namespace tessera::region
