// What goes over a link between regions after its hellos: the first byte tells what it is.
//
// Frames begin with the number of their format, which is small; the rest is the shell's own:
//
//   kLog       u8 last piece, bytes    a message of the sender's tick log, in pieces, for its standby
//   kLogTaken  u64 tick                the standby has the log up to that tick
//   kLogAgain                          it has a gap: a whole state is wanted
//   kAlive                             the sender waits, and is well
//   kLeaseAsk  u64 number              of a primary: may it go on?
//   kLeaseGiven u64 number             of the standby, which has not been told that the primary is dead
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
  std::span<const std::uint8_t> bytes;  // of a frame: all; of a log: the piece; of places: the rest
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
