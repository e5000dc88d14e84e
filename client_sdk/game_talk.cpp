#include "client_sdk/game_talk.h"

#include <utility>

#include "core/game/value.h"

namespace tessera::client {
namespace {

// "score", {{"team", "red"}, {"points", 3}}; INVALID_ARGUMENT where the values are malformed.
absl::StatusOr<GameEvent> EventFrom(const replication::EventOfGame& sent) {
  auto fields = game::DecodeFields(sent.values);
  if (!fields.ok()) return fields.status();
  GameEvent event;
  event.name = sent.name;
  for (auto& [name, value] : *fields) event.values.emplace_back(std::move(name), std::move(value));
  return event;
}

}  // namespace

std::optional<std::vector<std::uint8_t>> GameTalk::Write(TimePoint now, bool any_welcomed) {
  if (!any_welcomed) inbox_.AllLost();
  if (!any_welcomed || !commands_.Due(now)) return std::nullopt;
  return commands_.Write(now, inbox_.last());
}

GameTalk::News GameTalk::Take(const replication::NewsOfPlayer& news) {
  if (!inbox_.Accept(news.epoch)) return News::kOld;
  std::vector<GameEvent> came;
  for (const replication::EventOfGame& sent : news.events) {
    absl::StatusOr<GameEvent> event = EventFrom(sent);
    if (!event.ok()) return News::kMalformed;
    came.push_back(*std::move(event));
  }
  if (news.last_event < came.size()) return News::kMalformed;
  const bool any = !came.empty();
  inbox_.Take(news.last_event, std::move(came));
  commands_.Taken(news.last_command);
  if (any) commands_.EventsCame();
  return News::kNew;
}

void GameTalk::Take(const replication::CommandRefusal& refusal) {
  if (refusal.for_good) commands_.Drop(refusal.number);
}

}  // namespace tessera::client
