// ArenaPlayer: plays games/arena as a person might: walks to a place from where the other goal can be reached, grabs
// what is in its way, throws, walks on. For the demo and for tests.
//
//   ArenaPlayer player(seed);
//   player.Welcome("red");                               // the game's event
//   const ArenaPlayer::Action act = player.Frame(place);  // 60 times a second
//   client.Steer(...); if (!act.command.empty()) client.Send(act.command);
//
// Pure: what it does follows from its seed and from where its body is. Thread rule: one thread at a time.
#pragma once

#include <cstdint>
#include <string>

#include "core/world/math.h"

namespace tessera::arena {

class ArenaPlayer {
 public:
  explicit ArenaPlayer(std::uint64_t seed) : random_(seed) {}

  // It is of this team, "red" or "blue", and plays from now on.
  void Welcome(const std::string& team);
  struct Action {
    Vec2f move;                 // as in PlayerInput
    float yaw_rad = 0;          // where it looks
    std::uint32_t buttons = 0;  // bit 0: it runs
    std::string command;        // for the game; empty: none
  };
  Action Frame(Vec3d position);

 private:
  std::string Throw(Vec3d from);
  void Wander();
  double Between(double low, double high);

  std::uint64_t random_;
  double side_ = 0;  // side of the other goal: 1 along +x; 0: it does not play yet
  Vec3d place_;
  int frames_ = 0, standing_ = 0;
};

}  // namespace tessera::arena
