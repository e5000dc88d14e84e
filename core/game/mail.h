// Mail: what a record keeps so that messages arrive exactly once, and in order between two ends.
//
// The sender numbers its messages and keeps each until the target's region acknowledges it; meanwhile regions send it
// again and again. A message names the one before it to the same target that was not acknowledged when it was made, so
// one that overtakes waits. The target keeps, of each sender, the number of the last message that was applied: between
// two ends numbers are applied ascending, so a message with that number or a lower one is a copy. The target may forget
// a sender once that has confirmed that it will never send those messages again, and copies under way have died out.
//
// All of it travels with the record: in grants, logs and checkpoints. Thread rule: plain values; nothing here knows of
// regions or of time but as arguments.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "core/world/bytes.h"
#include "core/world/ids.h"

namespace tessera::game {

// The most ticks that a copy of a message is under way, from when it was sent: regions drop older ones.
inline constexpr std::uint64_t kTransitTicks = 120;
// A target that has been silent to a sender for so many ticks acknowledges again, until that confirms; then after twice
// as many and so on, and at last every 32 times as many.
inline constexpr std::uint64_t kIdleTicks = 60;

// When a message is applied, ticks after it was made: within a region, and where `hops` borders lie between. The
// standby has to have it before it leaves, and a region may have promised not to send for two ticks.
inline constexpr std::uint64_t kDirectTicks = 2;
constexpr std::uint64_t DeliveryTicks(std::uint32_t hops) { return hops <= 1 ? 4 : 4 + 2 * (std::uint64_t{hops} - 1); }

// A verb above this one reports a contact or an overlap of the speaker and the target to the target's callback of that
// number: kEventVerbs + kOnBodyContact and so on. It is above all numbers of functions.
inline constexpr std::uint32_t kEventVerbs = 1024;

struct Message {
  BodyId speaker;          // the body whose callback sent it; 0: the world
  std::uint32_t verb = 0;  // a function of the table that its target carries out; 0: it is for on_message
  std::string name;
  std::vector<std::uint8_t> values;  // EncodeFields, at most kMaxMessageBytes
  friend bool operator==(const Message&, const Message&) = default;
};

// In the outbox of its sender.
struct SentMessage {
  std::uint64_t number = 0;  // counts the sender's messages
  std::uint64_t after = 0;   // the message to the same target that is applied before; 0: none is needed
  BodyId target;
  Tick made;
  RegionId made_in;
  Message what;
  friend bool operator==(const SentMessage&, const SentMessage&) = default;
};

// In the inbox of its target.
struct HeldMessage {
  BodyId sender;
  std::uint64_t number = 0, after = 0;
  Tick made, due;
  std::uint32_t hops = 0;  // between the regions of both ends when it was made
  Message what;
  friend bool operator==(const HeldMessage&, const HeldMessage&) = default;
};

struct Mail {
  struct Sender {
    BodyId id;
    std::uint64_t applied = 0;  // the highest number
    Tick heard;                 // its last message
    Tick ends;                  // it has confirmed, and is forgotten then; 0: it has not
    friend bool operator==(const Sender&, const Sender&) = default;
  };

  std::uint64_t last_number = 0;    // that a message of this record ever had
  std::uint64_t backend = 0;        // the highest number of a message of the game's backend that came here
  std::vector<SentMessage> outbox;  // ascending by number
  std::vector<HeldMessage> inbox;   // ascending by (sender, number)
  std::vector<Sender> senders;      // ascending

  bool empty() const { return *this == Mail(); }
  friend bool operator==(const Mail&, const Mail&) = default;

  // --- The sender's end.
  // Puts a message into the outbox, which is not full.
  const SentMessage& Post(BodyId target, Tick made, RegionId made_in, Message what);
  // The number of the newest message to this target that is not acknowledged; 0: there is none.
  std::uint64_t LastTo(BodyId target) const;
  // The target has it for good. Whether it was in the outbox.
  bool Acknowledged(BodyId target, std::uint64_t number);
  // Whether nothing up to this number is left for the target: it may forget that there was.
  bool Settled(BodyId target, std::uint64_t number) const;
  // The target is gone. Returns how many messages are dropped.
  std::size_t DropTo(BodyId target);

  // --- The target's end.
  enum class Arrival : std::uint8_t { kNew, kRepeated, kRefused };  // refused: there is no room now
  // A copy of a message has come to where the target is.
  Arrival Take(HeldMessage message, Tick now);
  // The same within one region: the sender's record is committed together with the target's, so there are no copies.
  // False: there is no room.
  bool TakeDirectly(HeldMessage message);
  // A message of the game's backend, for the next step. Whoever orders them repeats each until it is safe here, and
  // numbers them ascending, so that one number says which came. Refused: there is no room now.
  Arrival TakeFromBackend(std::uint64_t number, Message what, Tick now);
  // The messages that are to be applied in the step to `now`, by (due, sender, number). None is due before one of the
  // same sender with a lower number.
  std::vector<HeldMessage> Due(Tick now) const;
  std::optional<Tick> next_due() const;
  // The message is applied. Whether it was there.
  bool Applied(BodyId sender, std::uint64_t number, Tick now);
  // Whether to acknowledge this sender's messages again in the step to `now`.
  static bool RemindIn(const Sender& sender, Tick now);
  // The sender will not send any message up to this number again. Whether anything changed.
  bool Confirmed(BodyId sender, std::uint64_t number, Tick now);
  // Forgets senders whose time has come. Whether there were any.
  bool Forget(Tick now);
  bool ForgetsBy(Tick now) const;

 private:
  // Whether the message is one that may be applied next.
  bool Ready(std::vector<HeldMessage>::const_iterator message) const;
  const Sender* Find(BodyId id) const;
};

void Write(ByteWriter& out, const Message& message);
void ReadMessage(ByteReader& in, Message& message);
// INVALID_ARGUMENT: "a name is too long", "values: truncated".
absl::Status CheckMessage(const Message& message);
void Write(ByteWriter& out, const Mail& mail);
// Leaves a failed reader, or mail that CheckMail refuses, where the bytes are not sound.
Mail ReadMail(ByteReader& in);
// INVALID_ARGUMENT: "outbox: numbers do not ascend", "inbox: out of order", "senders: out of order" and so on.
absl::Status CheckMail(const Mail& mail);

}  // namespace tessera::game
