// TalkModel: one player's client as far as it talks with the game: gives commands, repeats them until a region has
// taken them for good, and takes the events. It uses the client library's own queue and inbox and the worker's own
// news; what goes between them may be lost, up and down.
//
//   TalkModel talk(simulation, PlayerNumber(1), {.seed = 7, .loss = 0.1});
//   talk.Begin(RegionId(1));
//   for (...) { talk.Give("jump"); talk.RunFor(Milliseconds(17)); }
//
// A message that a region sends down takes its time, each its own; it comes in order, and is lost only with its region,
// as on a reliable channel. Thread rule: one thread at a time.
#pragma once

#include <algorithm>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client_sdk/command_queue.h"
#include "client_sdk/event_inbox.h"
#include "core/game/value.h"
#include "core/replication/command.h"
#include "region_worker/player_news.h"
#include "tests/simulation/simulation.h"
#include "tests/simulation/virtual_time.h"

namespace tessera::simulation {

struct TalkOptions {
  std::uint64_t seed = 1;
  double loss = 0;  // share of datagrams up
};

class TalkModel {
 public:
  TalkModel(Simulation& simulation, PlayerNumber player, const TalkOptions& options)
      : simulation_(simulation), player_(player), loss_(options.loss), chance_(options.seed) {
    simulation_.on_step = [this, before = simulation_.on_step](SimulatedRegion& worker,
                                                               const region::StepResult& result) {
      if (before) before(worker, result);
      const auto message = worker::NewsFor(worker.region(), player_, sent_[worker.id()]);
      if (!message || !message->has_player_news()) return;
      auto& messages = under_way_[worker.id()];
      const Micros due = simulation_.timeline().now() + static_cast<Micros>(chance_.Between(20'000, 120'000));
      messages.emplace_back(std::max(due, messages.empty() ? due : messages.back().first), message->player_news());
    };
    simulation_.on_killed = [this, before = simulation_.on_killed](RegionId region) {
      if (before) before(region);
      sent_.erase(region);  // its connection, and what was on its way, is gone
      under_way_.erase(region);
    };
  }

  // False: as many wait as may. `with_input`: the input that it goes with; 0: none.
  bool Give(std::string_view bytes, std::uint32_t with_input = 0) {
    return commands_.Push(bytes, /*shown_at=*/0, with_input).ok();
  }
  // The number that the next command gets; nothing before a region has spoken.
  std::optional<std::uint32_t> next() const { return commands_.next(); }
  std::size_t pending() const { return commands_.pending(); }
  // A region took a command for the first time, as far as it knew.
  std::function<void(SimulatedRegion&, std::string_view)> on_taken;

  void RunFor(Micros time) {
    Exchange();
    simulation_.RunFor(time);
  }
  // Hears what has come by now, and says what is due.
  void Exchange() {
    for (auto& [region, messages] : under_way_) {
      for (; !messages.empty() && messages.front().first <= simulation_.timeline().now(); messages.pop_front()) {
        Hear(messages.front().second);
      }
    }
    Speak();
  }
  std::vector<client::GameEvent> TakeEvents() { return inbox_.TakeAll(); }
  std::uint64_t repeated() const { return repeated_; }

 private:
  void Hear(const v1::PlayerNews& news) {
    if (!inbox_.Accept(news.epoch())) return;
    std::vector<client::GameEvent> events;
    for (const v1::GameEvent& proto : news.events()) {
      client::GameEvent& event = events.emplace_back();
      event.name = proto.name();
      const std::span bytes(reinterpret_cast<const std::uint8_t*>(proto.values().data()), proto.values().size());
      const auto fields = game::DecodeFields(bytes);
      for (const auto& [name, value] : *fields) event.values.emplace_back(name, value);
    }
    if (!events.empty()) commands_.EventsCame();
    inbox_.Take(news.last_event(), std::move(events));
    commands_.Taken(news.last_command());
  }
  // To every region that lives: the client does not know better while the body changes hands.
  void Speak() {
    const auto now = TimePointAt(simulation_.timeline().now());
    if (!commands_.Due(now)) return;
    const std::vector<std::uint8_t> datagram = commands_.Write(now, inbox_.last());
    for (const auto& [id, worker] : simulation_.workers()) {
      if (chance_.Between(0, 1) < loss_) continue;
      const auto message = replication::DecodeCommands(datagram);
      worker->region().AcknowledgeEvents(player_, message->last_event);
      std::uint32_t number = message->base;
      for (const replication::Command& command : message->commands) {
        const absl::Status status = worker->region().TakeCommand(
            player_, {message->base, number++, command.bytes, command.shown_at, command.with_input});
        if (status.ok() && on_taken) on_taken(*worker, command.bytes);
        if (absl::IsAlreadyExists(status)) ++repeated_;
      }
    }
  }

  Simulation& simulation_;
  const PlayerNumber player_;
  const double loss_;
  Chance chance_;
  client::CommandQueue commands_;
  client::EventInbox inbox_;
  std::map<RegionId, std::optional<worker::SentNews>> sent_;
  std::map<RegionId, std::deque<std::pair<Micros, v1::PlayerNews>>> under_way_;
  std::uint64_t repeated_ = 0;
};

}  // namespace tessera::simulation
