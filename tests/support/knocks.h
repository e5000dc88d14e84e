// Knocks: tries to get in at ports of running workers, each by one handshake with whatever keys somebody has.
//
//   const Knock knock{.host = "127.0.0.1", .port = 7801, .region = RegionId(2), .credentials = stolen, .hello = {}};
//   for (const Knocked& answer : KnockAll({knock})) EXPECT_NE(answer.answer, Knocked::Answer::kOpened) << answer.said;
//
// Thread rule: any thread; blocks until all are answered or `patience` is over. CommandError: no socket is to be had.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/world/ids.h"
#include "net/credential.h"
#include "net/handshake.h"
#include "tessera/v1/game.pb.h"

namespace tessera::support {

inline constexpr std::chrono::milliseconds kKnockPatience{3000};

struct Knock {
  std::string host;
  std::uint16_t port = 0;
  RegionId region{};    // that the port is to be of
  Incarnation least{};  // in this life or a later one
  net::Credentials credentials{};
  // The first words at a link port; nothing: it is a game port.
  std::optional<v1::LinkHello> hello{};
};

struct Knocked {
  enum class Answer : std::uint8_t {
    kNone,     // nobody who could prove to be that region
    kRefused,  // `said` has the reason, empty where the connection ended without one
    kOpened,   // a link was confirmed, or a player welcomed
  };
  Answer answer = Answer::kNone;
  std::string said{};
  std::optional<net::Refused> by_acceptor{};  // refused before it was let in at all
};

// The answers in the order of the knocks. Whoever was let in leaves again.
std::vector<Knocked> KnockAll(const std::vector<Knock>& knocks, std::chrono::milliseconds patience = kKnockPatience);

}  // namespace tessera::support
