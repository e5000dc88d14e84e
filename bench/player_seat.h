// The other side of PlayerProcesses: one player, who plays until nobody gives orders any more.
//
// The player wanders as a Bot does, with 120 frames a second. Its standard output says what it sees in the lines of
// player_view.h: frames four times a second, all bodies every other second, gaps as they change. Its standard input
// brings one kind of line, "watch NUMBER REGION...": from then on the bodies of these regions are watched (GapWatch).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace tessera::bench {

struct PlayerSeat {
  std::string control;   // as Bot::Join takes it
  std::string instance;  // its id
  std::uint64_t seed = 1;
};

// This program's command lines for so many players, with seeds from 1.
std::vector<std::vector<std::string>> SeatCommands(const std::string& control, const std::string& instance,
                                                   std::uint32_t players);

// Exit status: 0 once the input has ended; 1 if the player did not come in or is out, which its last line says.
int PlayInSeat(const PlayerSeat& seat);

}  // namespace tessera::bench
