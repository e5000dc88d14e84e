// GameRecord: what a game keeps with a body, beside its properties: the timers that are to come, when the body expires,
// its messages, what the game does to it in the next steps, what it changed of its definition, of a player's body what
// the game and the player have said to each other, and of the world what waits for the game's backend. It goes wherever
// the body goes.
//
// Thread rule: plain values.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "core/game/blast.h"
#include "core/game/game_event.h"
#include "core/game/joint.h"
#include "core/game/mail.h"
#include "core/game/player_record.h"
#include "core/game/published.h"
#include "core/game/question.h"
#include "core/world/body_tuning.h"
#include "core/world/bytes.h"
#include "core/world/ids.h"
#include "core/world/math.h"

namespace tessera::game {

struct GameTimer {
  Tick due;
  std::uint32_t number = 0;  // each timer of a body has another one
  std::string name;
  std::vector<std::uint8_t> values;  // EncodeFields
  friend bool operator==(const GameTimer&, const GameTimer&) = default;
};

// A force that acts for a time, about the centre of mass and along the axes of the world.
struct GameForce {
  std::uint32_t number = 0;
  Tick ends;  // it acts in the step to this tick, and not after it
  Vec3f force_n, torque_nm;
  friend bool operator==(const GameForce&, const GameForce&) = default;
};

// Another place for the body, and all that joints connect to it. What is left out stays as it is then.
struct GameTeleport {
  Vec3d position;
  std::optional<Quatd> rotation;
  std::optional<Vec3f> velocity_m_s, spin_rad_s;
  friend bool operator==(const GameTeleport&, const GameTeleport&) = default;
};

// Where a kinematic body that a game moves is to be.
struct GameTarget {
  Tick arrives;
  Vec3d position;
  Quatd rotation;
  friend bool operator==(const GameTarget&, const GameTarget&) = default;
};

struct GameRecord {
  std::uint32_t last_timer = 0;   // highest number that a timer of the body ever had
  std::vector<GameTimer> timers;  // ascending by (due, number)
  Tick expires;                   // the body is removed then; 0: it stays
  std::uint32_t game = 0;         // number of the game that made the body, or that last took the record over
  // --- In the next step.
  Vec3f push_ns, push_nms;  // about the centre of mass
  bool wakes = false;       // even where nothing pushes it
  // The body was put elsewhere after the last step: the neighbours that see it must not take that for a motion.
  bool jumped = false;
  // --- In the steps to come.
  std::uint32_t last_force = 0;          // highest number that a force on the body ever had
  std::vector<GameForce> forces;         // ascending by number
  std::optional<GameTeleport> teleport;  // as soon as all neighbours that it concerns can hear of it
  std::optional<GameTarget> target;
  // --- For as long as the body lives.
  std::uint8_t jumps = 0;  // how often it was put elsewhere; after 255 comes 0
  BodyTuning tuning;
  std::vector<GameJoint> joints;  // to bodies with higher ids, ascending by them
  // The player whose inputs move the body, if it is no player's own; 0: nobody. Until `driver_until` it is awaited, and
  // another one may have the body from then on; 0: the player's record is in the same region, and says the same.
  PlayerNumber driver;
  Tick driver_until;
  // Area effects that are settled for the body, and that the region which owns it may yet hear of; ascending by id.
  std::vector<BlastMark> blasts;

  std::uint32_t last_question = 0;      // highest number that a question of the body ever had
  std::vector<GameQuestion> questions;  // ascending by number

  // Events whose turn had not come when the body was handed over, in their order: the host of the region that takes it
  // in goes on with them. While the body stays where it is, they are in its region's HostState.
  std::vector<GameEvent> waiting;

  Mail mail;
  // The body is gone. The record is left until its messages are acknowledged, and has nothing else.
  bool removed = false;
  SharedPlayerRecord player;  // set for a player's body
  Published published;        // set for the world

  bool empty() const { return *this == GameRecord(); }
  // Whether there is anything to do in the next step, or after it.
  bool acts() const {
    return push_ns != Vec3f() || push_nms != Vec3f() || wakes || jumped || !forces.empty() || teleport || target;
  }
  // The force and torque of the next step, in a world of so many ticks a second.
  Vec3f NextForce(float tick_rate_hz) const;
  Vec3f NextTorque(float tick_rate_hz) const;
  // The step to `tick` is over.
  void Acted(Tick tick);
  // The next tick in which the host has to look at it, for a timer, a message or because it expires.
  std::optional<Tick> next_due() const {
    std::optional<Tick> next = mail.next_due();
    const auto sooner = [&](Tick tick) { next = next ? std::min(*next, tick) : tick; };
    if (!timers.empty()) sooner(timers.front().due);
    if (expires != Tick()) sooner(expires);
    for (const GameQuestion& question : questions) sooner(question.due);
    return next;
  }
  friend bool operator==(const GameRecord&, const GameRecord&) = default;
};

void Write(ByteWriter& out, const GameRecord& record);
// Leaves a failed reader, or a record that CheckRecord refuses, where the bytes are not sound.
GameRecord ReadRecord(ByteReader& in);
// INVALID_ARGUMENT: "timers: out of order", "timers: more than 16", "timers: values: truncated", "push: is not finite"
// and so on.
absl::Status CheckRecord(const GameRecord& record);

}  // namespace tessera::game
