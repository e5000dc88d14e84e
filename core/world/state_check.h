// The check of every state, force and impulse that goes into physics or comes out: finite, and within limits.h.
//
// Scenes keep tighter limits from the start. This check is for a running world: frames of other regions, bodies after a
// step, inputs. All share one rule, so that nothing that an honest region sends is ever refused.
//
//   if (absl::Status status = CheckState(id, state); !status.ok()) return status;
//   // INVALID_ARGUMENT: body 7: linear_velocity.x must be a finite number, got nan
//
// Thread rule: free functions on values.
#pragma once

#include "absl/status/status.h"
#include "core/world/ids.h"
#include "core/world/scene.h"

namespace tessera {

// OK if IsSane, else INVALID_ARGUMENT with the body and the field.
absl::Status CheckState(BodyId id, const BodyState& state);
// The same rule as a yes or no, for every body in every tick.
bool IsSane(const BodyState& state);

// N and N m: each component within kMaxForce. INVALID_ARGUMENT naming the body and `force_n` or `torque_nm`.
absl::Status CheckForce(BodyId id, Vec3f force_n, Vec3f torque_nm);

// N s, and N m s about a centre of mass: each component within kMaxImpulse and kMaxAngularImpulse.
bool IsSaneImpulse(Vec3f impulse_ns);
bool IsSaneAngularImpulse(Vec3f impulse_nms);

}  // namespace tessera
