// GameTalk: a player's talk with the game: its commands on their way up, the game's events on their way down.
//
//   talk.Push(bytes, shown_at);
//   if (const auto datagram = talk.Write(now, any_welcomed)) Send(*datagram);   // once a poll
//   if (talk.Take(news) == GameTalk::News::kNew) ...                            // the region of the own body speaks
//
// Promise: each command is taken once and each event given once, both in order (CommandQueue, EventInbox).
// Pure: time comes in. Thread rule: one thread at a time.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "client_sdk/client.h"
#include "client_sdk/command_queue.h"
#include "client_sdk/event_inbox.h"
#include "core/replication/region_message.h"

namespace tessera::client {

class GameTalk {
 public:
  // As CommandQueue::Push.
  absl::Status Push(std::string_view bytes, std::uint64_t shown_at, std::uint32_t with_input = 0) {
    return commands_.Push(bytes, shown_at, with_input);
  }
  // The number of the next command; nothing before the first region has spoken.
  std::optional<std::uint32_t> next() const { return commands_.next(); }
  // The datagram that is due: commands that are not known to be taken, and how far events are here. While no region is
  // connected nothing is due, and events may begin anew after it.
  std::optional<std::vector<std::uint8_t>> Write(TimePoint now, bool any_welcomed);
  std::vector<GameEvent> TakeEvents() { return inbox_.TakeAll(); }

  enum class News : std::uint8_t { kMalformed, kOld, kNew };
  News Take(const replication::NewsOfPlayer& news);
  void Take(const replication::CommandRefusal& refusal);

 private:
  CommandQueue commands_;
  EventInbox inbox_;
};

}  // namespace tessera::client
