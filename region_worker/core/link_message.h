// Messages between regions on a link after its hellos: the first byte names the kind.
//
// Frames begin with the number of their format, which is small; the rest is the shell's own:
//
//   kLog       u8 last piece, bytes    a message of the sender's tick log, in pieces, for its standby
//   kLogTaken  u64 tick                the standby has the log up to that tick
//   kLogAgain                          it has a gap: a whole state is wanted
//   kAlive                             the sender waits, and is well
//   kLeaseAsk  u64 number              from a primary: may it go on?
//   kLeaseGiven u64 number             from the standby, which does not know the primary to be dead
//   kPlaces    player_places.h         where players' bodies are, for all neighbours
//
// Thread rule: free functions on values.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace tessera::worker {

enum class LinkMessageKind : std::uint8_t {
  kFrame = 0,
  kLog = 64,
  kLogTaken = 65,
  kLogAgain = 66,
  kAlive = 67,
  kLeaseAsk = 68,
  kLeaseGiven = 69,
  kPlaces = 70
};

struct LinkMessage {
  LinkMessageKind kind = LinkMessageKind::kFrame;
  std::span<const std::uint8_t> bytes;  // all of a frame; the piece of a log; the rest of places
  bool last = false;                    // kLog
  std::uint64_t number = 0;             // kLogTaken (the tick), kLeaseAsk, kLeaseGiven
};

// Empty: of no known form.
std::optional<LinkMessage> ReadLinkMessage(std::span<const std::uint8_t> bytes);

// A log message as pieces that fit a link, each to be sent by itself.
std::vector<std::vector<std::uint8_t>> LogPieces(std::span<const std::uint8_t> log);
std::vector<std::uint8_t> Numbered(LinkMessageKind kind, std::uint64_t number);  // kLogTaken, kLeaseAsk, kLeaseGiven
std::vector<std::uint8_t> Bare(LinkMessageKind kind);                            // kLogAgain, kAlive

}  // namespace tessera::worker
