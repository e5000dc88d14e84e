// Published: the events of a game for its backend, as the world's record keeps them until the control plane has stored
// them.
//
// An event comes to the record as a message, so each comes once, and those of one sender in order. Here all of them get
// numbers, from 1 on. They wait until they are acknowledged; beyond kMaxPublished of them, or kMaxPublishedBytes, which
// is when nobody takes them, later ones are left out, and the next one that is kept says how many.
//
// Thread rule: plain values.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "core/world/bytes.h"
#include "core/world/ids.h"

namespace tessera::game {

struct PublishedEvent {
  std::uint64_t number = 0;
  std::uint64_t missed = 0;  // events before it that were left out
  Tick tick;                 // the step in which it came here
  BodyId source;             // the body whose callback published it; 0: the world
  std::string name;
  std::vector<std::uint8_t> values;  // EncodeFields, at most kMaxMessageBytes
  std::size_t bytes() const { return name.size() + values.size(); }
  friend bool operator==(const PublishedEvent&, const PublishedEvent&) = default;
};

struct Published {
  // Events are shared, because records are copied with each call of a game.
  using Event = std::shared_ptr<const PublishedEvent>;

  std::uint64_t last = 0;      // number of the newest event that was kept
  std::uint64_t left_out = 0;  // since then
  std::vector<Event> waiting;  // ascending by number

  // Gives the event its number. False: too many wait, and it is left out.
  bool Add(PublishedEvent event);
  // Drops the events up to this number. Whether there were any.
  bool Acknowledge(std::uint64_t number);
  bool empty() const { return last == 0 && left_out == 0; }
  friend bool operator==(const Published& a, const Published& b);
};

void Write(ByteWriter& out, const Published& published);
// Leaves a failed reader, or a value that CheckPublished refuses, where the bytes are not sound.
Published ReadPublished(ByteReader& in);
// INVALID_ARGUMENT: "published: numbers do not ascend", "published: values: truncated" and so on.
absl::Status CheckPublished(const Published& published);

}  // namespace tessera::game
