// Frame: what a region sends one neighbour for one tick, and its lossless wire form.
//
// Made after the step to `tick` and used by the receiver at the start of the step to tick + 1. Frames of a link come in
// order, one a tick, so a sleeping ghost that did not change since the frame before costs a byte or so: both ends keep
// that frame's ghosts. docs/protocol.md describes the bytes.
//
//   Bytes bytes = Encode(frame, ghosts_of_the_frame_before);
//   absl::StatusOr<Frame> frame = Decode(bytes, ghosts_of_the_frame_before);
//
// Thread rule: free functions on values.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/region/message_packet.h"
#include "core/region/record_table.h"
#include "core/world/bytes.h"
#include "core/world/ids.h"
#include "core/world/movement.h"
#include "core/world/player_input.h"
#include "core/world/scene.h"

namespace tessera::region {

// A body of the sender's that the receiver must see. `force_n` and `torque_nm` are what a player's input will do to it
// in the next step (fields are not among them: both sides compute those).
//
// `load_ns` and `load_nms` are what bodies that the receiver does not see do to it in a tick, as a mean of about ten:
// what lies on it, and what it lies on. Without them a ghost in a pile would fall in every step, and press on what is
// solved beside it with a weight that it does not have.
//
// One that is `externally_supported` touches bodies that the receiver does not see, which may not bear it yet, or no
// more: the bodies that the receiver sees on it are not all that it has to bear, nor those below it all that bear it.
//
// `island_load` is the load of its island at the sender (physics::World::IslandLoadOf), so that both sides solve it in
// equally many substeps. 0 for the others: the receiver sees all bodies that they touch.
//
// One that `jumped` was put where it is after the last step, and did not move there. One that is `woken` wakes with the
// next step. `tuning` is what a game changed of its definition. Its `joints` hold it where the sender owns the
// other body, too.
//
// One that is `settled` has lain still for a while. Its load includes that of other settled bodies on it, whether the
// receiver sees them or not, except for the receiver's own: settled ghosts are not solved against each other there.
struct GhostRecord {
  BodyId id;
  Epoch epoch;
  BodyState state;
  Vec3f force_n, torque_nm;
  Vec3f load_ns, load_nms;
  bool settled = false;
  bool externally_supported = false;
  float island_load = 0;
  bool jumped = false, woken = false;
  BodyTuning tuning = {};
  std::vector<game::GameJoint> joints = {};  // that a game gave it

  bool altered() const { return jumped || woken || !tuning.empty() || !joints.empty(); }
};

// The impulses of the sender's solver in the last step on its body `own`, which touched `other`, a ghost there.
struct ImpulseRecord {
  BodyId own, other;
  Vec3f impulse_on_own;                    // N s; `other` received the opposite
  Vec3f angular_on_own, angular_on_other;  // about each one's centre of mass, N m s
};

// All that a region knows about the steering of a player's body.
struct PlayerControl {
  std::uint32_t last_input = 0;  // number of the last one that moved the body
  bool committed = false;        // an input is chosen for the next step
  // That input; its force and torque are those of the next step: what the input asks for within the scene's limits, or
  // what moves a character, which is moved while none is chosen, too. Its other fields stay until another is chosen.
  PlayerInput next{};
  std::uint8_t held = 0;             // ticks for which a character's last input has stood in for a missing one
  std::vector<PlayerInput> queue{};  // ascending by number
  // Private state of the movement that a game wrote: as it was for the input that acts, and after the next one.
  MovementState state{}, next_state{};
  friend bool operator==(const PlayerControl&, const PlayerControl&) = default;
};

// A touching pair whose events the new owner reports from now on.
struct TouchingPair {
  BodyId body_a, body_b;
  bool trigger = false;
  friend auto operator<=>(const TouchingPair&, const TouchingPair&) = default;
};

struct GrantedBody {
  BodyId id;
  Epoch epoch;  // that the new owner begins with
  BodyState state;
  CarriedRecord record = {};
};

// One assembly changes hands: from the step to frame.tick + 1 on, the receiver owns it.
struct Grant {
  std::vector<GrantedBody> bodies;  // ascending
  PlayerControl control;            // for a player's body; otherwise as made
  std::vector<TouchingPair> touching;
};

// The player whose body is among them, at most one; 0: none.
PlayerNumber PlayerIn(const Grant& grant);

// The sender owns what it was granted: the granter may forget it.
struct GrantAcknowledgement {
  BodyId id;
  Epoch epoch;
};

// The granter's last share of an impulse exchange, for a body that it had already handed over.
struct LateCorrection {
  BodyId id;
  Vec3f impulse_ns, angular_nms;
};

// Where a frame stands in the life of its link (border_link.h).
struct FrameStamp {
  // How often the link went down: by the sender, and by the receiver, as far as the sender knows.
  std::uint64_t outages = 0, peer_outages = 0;
  std::uint64_t number = 0;    // counts frames since the link came up
  std::uint32_t promised = 0;  // the next so many frames are like this one, and do not come
  bool reconnect = false;      // no frame: the link is down, and the sender asks to reconnect
  Tick up_at;                  // in such a request: the link comes up with the frames of this tick; 0: not known yet
  friend bool operator==(const FrameStamp&, const FrameStamp&) = default;
};

struct BorderFrameHeader {
  Tick tick;
  RegionId sender;
  MapVersion map_version;        // in force for this frame
  MapVersion committed_version;  // the newest that the sender knows to be committed; 0: none
  FrameStamp stamp;
};

// Holds what a neighbour may read of a ghost (shared_properties.h).
struct GhostProperties {
  BodyId body;
  std::vector<std::uint8_t> bytes;  // PropertySet::Encode
  friend bool operator==(const GhostProperties&, const GhostProperties&) = default;
};

struct BorderFrame {
  Tick tick;
  RegionId sender;
  MapVersion map_version, committed_version;  // as in the header
  FrameStamp stamp;
  std::vector<GhostRecord> ghosts;      // ascending by id
  std::vector<ImpulseRecord> impulses;  // ascending by the pair's lower id, then its higher
  std::vector<Grant> grants;
  std::vector<GrantAcknowledgement> acknowledgements;
  std::vector<LateCorrection> late_corrections;
  std::vector<PlayerInput> inputs;          // reached the granter after it had sent the grant
  std::vector<GhostProperties> properties;  // ghosts of this frame, ascending: those not sent to the receiver before
  std::vector<MessagePacket> packets;
};

// The parts of a grant that the log has too. A control has its last input, two bytes, its next input, a count and two
// states of a movement.
inline constexpr std::size_t kMinControlBytes = 1 + 2 + 1 + kMinSteeringBytes + 1 + 2;
void WriteControl(ByteWriter& out, const PlayerControl& control);
void ReadControl(ByteReader& in, PlayerNumber player, PlayerControl& control);
void WriteRecord(ByteWriter& out, const CarriedRecord& record);
void ReadRecord(ByteReader& in, CarriedRecord& record);

bool SameBits(const BodyState& a, const BodyState& b);

std::vector<std::uint8_t> Encode(const BorderFrame& frame, std::span<const GhostRecord> previous);
// Only the first few bytes are looked at.
absl::StatusOr<BorderFrameHeader> DecodeHeader(std::span<const std::uint8_t> bytes);
// INVALID_ARGUMENT if the bytes are not a frame: truncated, a count too large, ids not ascending, trailing bytes, an
// unchanged ghost that was not in `previous`. Values are not judged: see frame_check.h.
absl::StatusOr<BorderFrame> Decode(std::span<const std::uint8_t> bytes, std::span<const GhostRecord> previous);

}  // namespace tessera::region
