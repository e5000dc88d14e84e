// MessagePacket: what frames carry for the messages of game code, from region to region: a copy of a message, what its
// target's region answers, and the properties of the world.
//
// Thread rule: free functions on values.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "core/game/mail.h"
#include "core/world/bytes.h"
#include "core/world/ids.h"

namespace tessera::region {

class Catalog;

enum class PacketKind : std::uint8_t {
  kMessage = 1,
  kAcknowledged = 2,  // `from` has the message of this number for good
  kConfirmed = 3,     // `from` sends nothing up to this number again
  kGone = 4,          // `from` was removed, and gets no messages
  kInstance = 5,      // properties of the world; the number is the epoch of its record
  kQuestion = 7,      // a query of `from`, for the region `via`; the number is the question's
  kAnswer = 8,        // an answer from the region `origin`, for the region `via`
  kBlast = 9,         // an area effect; the number is its own. It goes from neighbour to neighbour
  kPlace = 6,         // `origin` owns the record `from` now, under the epoch that is the number
};

struct MessagePacket {
  PacketKind kind = PacketKind::kMessage;
  BodyId from, to;  // records; `to` is 0 for what is for all regions
  std::uint64_t number = 0;
  RegionId origin;  // the region that sent this copy
  RegionId via;     // the region that it is sent to; 0: all, until one has the record
  Tick sent;        // when this copy was
  // A message, properties, a question and its answer say when and in which region they were made.
  Tick made;
  RegionId made_in;
  std::uint64_t after = 0;               // as in SentMessage
  game::Message what;                    // set for a message
  std::vector<std::uint8_t> properties;  // for the world: PropertySet::Encode; for questions: EncodeQuestion,
                                         // EncodeAnswer; for a blast: game::Write
  friend bool operator==(const MessagePacket&, const MessagePacket&) = default;
};

// Packets of one frame; the others wait for the next.
inline constexpr std::size_t kMaxPackets = 512;

void Write(ByteWriter& out, const std::vector<MessagePacket>& packets);
// Leaves a failed reader, or packets that CheckPacket refuses, where the bytes are not sound.
void Read(ByteReader& in, std::vector<MessagePacket>& packets);
// INVALID_ARGUMENT naming the body: one that does not move, values that are not sound, properties that the scene does
// not declare.
absl::Status CheckPacket(const MessagePacket& packet, const Catalog& catalog);

}  // namespace tessera::region
