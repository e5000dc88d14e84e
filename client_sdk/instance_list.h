// The instances that a control plane runs, as a menu shows them.
//
// Thread rule: any thread; the call waits for the answer.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace tessera::client {

struct ListedInstance {
  std::string id, scene, game;
  std::uint8_t state = 0;  // tessera.v1.InstanceState
  std::uint32_t regions = 0, players = 0, expected_players = 0;
  // Names of those who are in, at most kMaxListedNames, and of the first 16 worlds that wait for players; one without a
  // name is "player 3".
  std::vector<std::string> names{};
};
inline constexpr std::size_t kMostListed = 256, kMostListedNames = 16;

// In the control plane's order, those that have ended too; at most kMostListed. Errors: UNAVAILABLE "control plane at
// ...", DEADLINE_EXCEEDED, INTERNAL.
absl::StatusOr<std::vector<ListedInstance>> ListInstances(const std::string& control_address,
                                                          std::chrono::milliseconds deadline);

}  // namespace tessera::client
