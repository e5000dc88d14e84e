// Viewers: clients without a body, which see all of a world and take no part in it.
//
// A viewer has a number as a player has, from a range that no player reaches, so that every region knows it by its
// credential alone: no order names it, and nothing about it is stored.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/world/ids.h"

namespace tessera {

// Players are numbered from 1 as they come; viewers have random numbers from here on: strangers' viewers, who come by
// the players' door, from the lower half, and from kFirstTrustedViewer on those of operators and gateways. (A control
// plane of 0.1 draws from both for both.)
inline constexpr std::uint32_t kFirstViewer = std::uint32_t{1} << 31;
inline constexpr std::uint32_t kFirstTrustedViewer = kFirstViewer + kFirstViewer / 2;
// Viewers that one region serves at once. Each costs it what a player costs that sees everything, so programs that show
// a world to many (tessera-gateway) join once for all.
inline constexpr std::size_t kMaxViewers = 32;
// Strangers' are at most so many of them, or a few strangers would keep every gateway out.
inline constexpr std::size_t kMaxStrangersViewers = kMaxViewers / 2;

constexpr bool IsViewer(PlayerNumber player) { return player.value() >= kFirstViewer; }
constexpr bool IsStrangersViewer(PlayerNumber player) {
  return IsViewer(player) && player.value() < kFirstTrustedViewer;
}

}  // namespace tessera
