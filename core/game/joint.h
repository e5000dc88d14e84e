// GameJoint: a joint that a game made between two bodies while the world runs. It stands in the record of the body with
// the lower id, and so goes wherever that body goes.
//
// It is in force while one region owns both bodies, which are then handed over together. Until they have met it waits:
// the lower body is granted to the region of the other one, and the joint is made in the step that takes it in.
// Thread rule: plain values.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/world/bytes.h"
#include "core/world/ids.h"
#include "core/world/scene.h"

namespace tessera::game {

enum class GameJointKind : std::uint8_t {
  kBall = 1,
  kFixed = 2,
  kHinge = 3,
  kSlider = 4,
  kSpring = 5,    // pulls both points together, softly
  kDistance = 6,  // keeps the second point within `upper` of the first, along each of the first body's axes
};

struct GameJoint {
  JointId id;
  BodyId other;  // above the id of the body that has it
  GameJointKind kind = GameJointKind::kBall;
  Pose frame, other_frame;                    // in the coordinates of each body's shape
  float lower = 1, upper = -1;                // rad of a hinge, m; lower > upper: free
  float stiffness_n_m = 0, damping_ns_m = 0;  // spring alone
  bool bodies_collide = false;
  Tick until;  // when a joint that waits is given up; 0: it was made
  // The record that hears, by a message of this name, whether the joint was made; nobody where the name is empty.
  std::string answer;
  BodyId asked_by;
  friend bool operator==(const GameJoint&, const GameJoint&) = default;
};

// Joints of one body to bodies with higher ids.
inline constexpr std::size_t kMaxGameJoints = 8;
// Bodies that joints make into one. They are handed over in one frame, and no region may split them.
inline constexpr std::size_t kMaxJointedBodies = 32;
// From one body's place to the other's. A longer joint would reach beyond what a region sees of the next.
inline constexpr double kMaxJointReach_m = 20;
inline constexpr double kMaxJointStiffness = 1e6;  // N/m, and N s/m of the damping; a ton on a spring of a centimetre

// The joint of `body` as the physics has it.
JointDef DefinitionOf(const GameJoint& joint, BodyId body);

// One that is in force, and the body that has it.
struct JointOfBody {
  BodyId body;
  GameJoint joint;
  friend bool operator==(const JointOfBody&, const JointOfBody&) = default;
};
// As a client is told of them: without what only the game needs. At most kMaxToldJoints; none are no bytes.
inline constexpr std::size_t kMaxToldJoints = 64;
std::vector<std::uint8_t> EncodeJoints(const std::vector<JointOfBody>& joints);
// INVALID_ARGUMENT: truncated, too many, or as CheckJoints and CheckJointsOf.
absl::StatusOr<std::vector<JointOfBody>> DecodeJoints(std::span<const std::uint8_t> bytes);

void Write(ByteWriter& out, const std::vector<GameJoint>& joints);
// Leaves a failed reader, or joints that CheckJoints refuses, where the bytes are not sound.
void ReadJoints(ByteReader& in, std::vector<GameJoint>& joints);
// INVALID_ARGUMENT: "joints: more than 8", "joints: out of order", "joints: a frame is not finite" and so on.
absl::Status CheckJoints(const std::vector<GameJoint>& joints);
// The same for the body that has them.
absl::Status CheckJointsOf(BodyId body, const std::vector<GameJoint>& joints);

}  // namespace tessera::game
