// What physics may be given and may give back: states, forces and impulses that are finite and within limits.h.
//
// Scenes are held to tighter limits when they are resolved. This is for what comes later: frames of other regions, what
// a step made of a body, inputs. One rule for all of them, so that what an honest region tells is never refused.
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

// INVALID_ARGUMENT naming the body and the field, unless IsSane.
absl::Status CheckState(BodyId id, const BodyState& state);
// The same rule without words, for every body in every tick.
bool IsSane(const BodyState& state);

// N and N m: each component within kMaxForce. INVALID_ARGUMENT naming the body and `force_n` or `torque_nm`.
absl::Status CheckForce(BodyId id, Vec3f force_n, Vec3f torque_nm);

// N s, and N m s about a centre of mass: each component within kMaxImpulse and kMaxAngularImpulse.
bool IsSaneImpulse(Vec3f impulse_ns);
bool IsSaneAngularImpulse(Vec3f impulse_nms);

}  // namespace tessera
