#include "core/region/frame_check.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "core/region/settings.h"
#include "core/world/limits.h"
#include "core/world/state_check.h"

namespace tessera::region {
namespace {

absl::Status Bad(BodyId id, const std::string& what) {
  return absl::InvalidArgumentError(absl::StrCat("body ", id.value(), what));
}

// The largest force that moves a player's body, N.
double MostForceOf(const PlayerRules& player) {
  return player.character.has_value() ? kMaxAcceleration_m_s2 * player.body.mass_kg : player.max_force_n;
}

// A player's body may be pushed by an input within the scene's limits; others are pushed by fields alone, or by a game.
absl::Status CheckPush(BodyId id, Vec3f force_n, Vec3f torque_nm, const Catalog& catalog) {
  if (force_n == Vec3f() && torque_nm == Vec3f()) return absl::OkStatus();
  if (!IsPlayerBody(id) && !catalog.has_game()) return Bad(id, " is pushed and is no player's");
  if (absl::Status status = CheckForce(id, force_n, torque_nm); !status.ok() || catalog.has_game()) return status;
  const double most = MostForceOf(*catalog.scene().player) * (1 + kUnitTolerance);
  return Length(Vec3d(force_n)) <= most ? absl::OkStatus() : Bad(id, ": force_n is more than a player's");
}

absl::Status CheckImpulse(BodyId id, Vec3f impulse_ns) {
  return IsSaneImpulse(impulse_ns) ? absl::OkStatus() : Bad(id, ": impulse is not finite or beyond limits");
}

absl::Status CheckAngularImpulse(BodyId id, Vec3f impulse_nms) {
  return IsSaneAngularImpulse(impulse_nms) ? absl::OkStatus()
                                           : Bad(id, ": angular impulse is not finite or beyond limits");
}

// One that has a shape and moves.
absl::Status CheckBody(BodyId id, const Catalog& catalog) {
  return id == kInstanceBody ? Bad(id, " has no shape") : CheckKnown(id, catalog);
}

absl::Status CheckImpulses(const BorderFrame& frame, const Catalog& catalog) {
  std::pair<BodyId, BodyId> last;
  for (const ImpulseRecord& record : frame.impulses) {
    const BodyId own = record.own, other = record.other;
    if (absl::Status status = CheckBody(own, catalog); !status.ok()) return status;
    if (absl::Status status = CheckBody(other, catalog); !status.ok()) return status;
    if (own == other) return Bad(own, " touches itself");
    const std::pair<BodyId, BodyId> pair = std::minmax(own, other);
    if (pair <= last) return Bad(own, ": impulses do not ascend");
    last = pair;
    if (absl::Status status = CheckImpulse(own, record.impulse_on_own); !status.ok()) return status;
    if (absl::Status status = CheckAngularImpulse(own, record.angular_on_own); !status.ok()) return status;
    if (absl::Status status = CheckAngularImpulse(other, record.angular_on_other); !status.ok()) return status;
  }
  for (const LateCorrection& late : frame.late_corrections) {
    if (absl::Status status = CheckImpulse(late.id, late.impulse_ns); !status.ok()) return status;
    if (absl::Status status = CheckAngularImpulse(late.id, late.angular_nms); !status.ok()) return status;
  }
  return absl::OkStatus();
}

absl::Status CheckInput(const PlayerInput& input) {
  const char* wrong = WrongField(input);
  return wrong == nullptr ? absl::OkStatus() : Bad(input.body, absl::StrCat(": an input's ", wrong));
}

// All of them hang together by joints of the scene, of a prefab or of a game.
absl::Status CheckOneAssembly(const Grant& grant, const Catalog& catalog) {
  const auto index_of = [&](BodyId id) {
    const auto at = std::ranges::lower_bound(grant.bodies, id, {}, &GrantedBody::id);
    return at != grant.bodies.end() && at->id == id ? at - grant.bodies.begin() : std::ptrdiff_t{-1};
  };
  std::vector<bool> reached(grant.bodies.size(), false);
  reached[0] = true;
  for (bool more = true; more;) {
    more = false;
    const auto reach = [&](std::ptrdiff_t index) {
      if (index < 0 || reached[static_cast<std::size_t>(index)]) return;
      reached[static_cast<std::size_t>(index)] = more = true;
    };
    for (std::size_t i = 0; i < grant.bodies.size(); ++i) {
      const GrantedBody& body = grant.bodies[i];
      if (reached[i]) {
        for (const BodyId member : catalog.AssemblyOf(body.id)) reach(index_of(member));
      }
      const game::GameRecord& game = body.record.game;
      const BodyId rides = game.driver != PlayerNumber() ? PlayerBodyId(game.driver) : game.player->controls;
      if (reached[i] && rides != BodyId()) reach(index_of(rides));
      for (const game::GameJoint& joint : body.record.game.joints) {
        const std::ptrdiff_t other = index_of(joint.other);
        if (other < 0) continue;
        if (reached[i]) reach(other);
        if (reached[static_cast<std::size_t>(other)]) reach(static_cast<std::ptrdiff_t>(i));
      }
    }
  }
  const auto apart = std::ranges::find(reached, false);
  if (apart == reached.end()) return absl::OkStatus();
  return Bad(grant.bodies[static_cast<std::size_t>(apart - reached.begin())].id, " is not of the assembly");
}

absl::Status CheckGrant(const Grant& grant, const Catalog& catalog) {
  if (grant.bodies.empty()) return absl::InvalidArgumentError("a grant without bodies");
  BodyId last;
  for (const GrantedBody& body : grant.bodies) {
    if (absl::Status known = CheckKnown(body.id, catalog); !known.ok()) return known;
    if (absl::Status state = CheckState(body.id, body.state); !state.ok()) return state;
    if (body.id <= last) return Bad(body.id, ": granted bodies do not ascend");
    if (body.epoch.value() < 2) return Bad(body.id, ": a grant's epoch is at least 2");
    if (absl::Status status = CheckRecord(body.id, body.record, catalog); !status.ok()) return status;
    last = body.id;
  }
  if (absl::Status status = CheckOneAssembly(grant, catalog); !status.ok()) return status;
  const auto is_player = [](const GrantedBody& body) { return IsPlayerBody(body.id); };
  if (std::ranges::count_if(grant.bodies, is_player) > 1) return Bad(last, ": two players in one grant");
  const PlayerNumber player = PlayerIn(grant);
  const BodyId steered = player == PlayerNumber() ? grant.bodies[0].id : PlayerBodyId(player);
  return CheckControl(steered, grant.control, catalog);
}

absl::Status CheckGhostJoints(const GhostRecord& ghost, const Catalog& catalog) {
  absl::Status status = game::CheckJoints(ghost.joints);
  if (status.ok()) status = game::CheckJointsOf(ghost.id, ghost.joints);
  if (!status.ok()) return Bad(ghost.id, absl::StrCat(": ", status.message()));
  for (const game::GameJoint& joint : ghost.joints) {
    if (!catalog.Known(joint.other) || joint.other == kInstanceBody) return Bad(joint.other, " is jointed and no body");
  }
  return absl::OkStatus();
}

bool HasGhost(const BorderFrame& frame, BodyId id) {
  const auto before = [](const GhostRecord& ghost, BodyId wanted) { return ghost.id < wanted; };
  const auto it = std::lower_bound(frame.ghosts.begin(), frame.ghosts.end(), id, before);
  return it != frame.ghosts.end() && it->id == id;
}

}  // namespace

absl::Status CheckKnown(BodyId id, const Catalog& catalog) {
  return catalog.Known(id) ? absl::OkStatus() : Bad(id, " is not a dynamic body of the scene");
}

absl::Status CheckControl(BodyId id, const PlayerControl& control, const Catalog& catalog) {
  if (absl::Status push = CheckPush(id, control.next.force_n, control.next.torque_nm, catalog); !push.ok()) return push;
  if (absl::Status status = CheckInput(control.next); !status.ok()) return status;
  if (control.queue.size() > kMaxGrantedInputs) return Bad(id, ": too many queued inputs");
  std::uint32_t last = std::max(control.last_input, control.committed ? control.next.number : 0);
  for (const PlayerInput& input : control.queue) {
    if (input.number <= last) return Bad(id, ": input numbers do not ascend");
    if (absl::Status status = CheckInput(input); !status.ok()) return status;
    last = input.number;
  }
  return absl::OkStatus();
}

absl::Status CheckFrame(const BorderFrame& frame, const Catalog& catalog) {
  for (const GhostRecord& ghost : frame.ghosts) {
    if (absl::Status known = CheckBody(ghost.id, catalog); !known.ok()) return known;
    if (absl::Status state = CheckState(ghost.id, ghost.state); !state.ok()) return state;
    if (ghost.epoch.value() == 0) return Bad(ghost.id, ": epoch 0");
    if (absl::Status push = CheckPush(ghost.id, ghost.force_n, ghost.torque_nm, catalog); !push.ok()) return push;
    if (absl::Status load = CheckImpulse(ghost.id, ghost.load_ns); !load.ok()) return load;
    if (!(ghost.island_load >= 0) || !std::isfinite(ghost.island_load)) {
      return Bad(ghost.id, ": island_load is negative or not finite");
    }
    if (absl::Status load = CheckAngularImpulse(ghost.id, ghost.load_nms); !load.ok()) return load;
    if (!IsSane(ghost.tuning)) return Bad(ghost.id, ": tuning is not finite or beyond limits");
    if (absl::Status status = CheckGhostJoints(ghost, catalog); !status.ok()) return status;
  }
  if (absl::Status status = CheckImpulses(frame, catalog); !status.ok()) return status;
  std::vector<BodyId> granted;
  for (const Grant& grant : frame.grants) {
    if (absl::Status status = CheckGrant(grant, catalog); !status.ok()) return status;
    for (const GrantedBody& body : grant.bodies) {
      if (HasGhost(frame, body.id)) return Bad(body.id, " is granted and a ghost");
      granted.push_back(body.id);
    }
  }
  std::sort(granted.begin(), granted.end());
  const auto twice = std::adjacent_find(granted.begin(), granted.end());
  if (twice != granted.end()) return Bad(*twice, " is granted twice");
  for (const PlayerInput& input : frame.inputs) {
    if (!IsPlayerBody(input.body)) return Bad(input.body, " is no player's");
    if (absl::Status status = CheckInput(input); !status.ok()) return status;
  }
  BodyId last;
  for (const GhostProperties& one : frame.properties) {
    if (one.body <= last) return Bad(one.body, ": bodies with properties do not ascend");
    if (!HasGhost(frame, one.body)) return Bad(one.body, " has properties and is no ghost");
    const auto set = PropertySet::Decode(one.bytes, catalog.scene().properties);
    if (!set.ok()) return Bad(one.body, absl::StrCat(": ", set.status().message()));
    last = one.body;
  }
  for (const MessagePacket& packet : frame.packets) {
    if (absl::Status status = CheckPacket(packet, catalog); !status.ok()) return status;
  }
  return absl::OkStatus();
}

}  // namespace tessera::region
