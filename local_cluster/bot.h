// Bot: a player that wanders through a world, for demos, benchmarks and tests.
//
// It walks from waypoint to waypoint, drawn from its seed inside the world's bounds, so that it crosses every border
// sooner or later. In the world of games/arena it plays. Thread rule: one thread at a time.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client_sdk/client.h"
#include "games/arena/bot/arena_player.h"
#include "trust/credentials.h"

namespace tessera::local {

class Bot {
 public:
  // Errors: those of Client::Join. `returning`, `predict`, `ticket`: as in client::JoinOptions; with a ticket `name` is
  // not sent.
  static absl::StatusOr<std::unique_ptr<Bot>> Join(const trust::ControlPoint& control, const std::string& instance_id,
                                                   const std::string& name, std::uint64_t seed,
                                                   const std::vector<std::uint8_t>& returning = {},
                                                   bool predict = false, const std::string& ticket = "");

  // Watches a recording; errors: those of Client::Play.
  static absl::StatusOr<std::unique_ptr<Bot>> Play(const std::string& file);

  // After its client has ended: joins again as the same player and plays on. Waits for the control plane's answer, 2 s
  // at most. Errors: those of Client::Join; the bot stays ended.
  absl::Status ComeBack();

  // One frame of a game: takes in, steers, looks. Call about 60 times a second. False once the client has ended. Where
  // the client needs a newer grant it asks the control plane, for whose answer it waits, 1 s at most.
  bool Frame(client::TimePoint now);

  client::Client& client() { return *client_; }
  // The events that the last frame took in.
  const std::vector<client::ClientEvent>& events() const { return events_; }
  // Contacts and triggers so far: began or entered, ended or left.
  std::uint64_t pairs_begun() const { return pairs_begun_; }
  std::uint64_t pairs_ended() const { return pairs_ended_; }
  const std::string& name() const { return join_.player_name; }
  std::uint64_t region_changes() const { return region_changes_; }  // how often its own body crossed a border

 private:
  Bot(std::unique_ptr<client::Client> client, client::JoinOptions join, std::uint64_t seed)
      : client_(std::move(client)), join_(std::move(join)), random_(seed), arena_player_(seed) {}
  void Renew(client::TimePoint now);
  void Steer(const client::SeenBody& self);
  void PlayArena(const client::SeenBody& self, client::TimePoint now);
  double Random();  // in [0, 1)

  std::unique_ptr<client::Client> client_;
  client::JoinOptions join_;
  std::uint64_t random_;
  std::optional<client::TimePoint> renew_at_;  // the client is without a region, and wants another grant
  std::optional<Vec3d> waypoint_;
  arena::ArenaPlayer arena_player_;
  client::TimePoint next_play_;
  RegionId region_;
  std::vector<client::ClientEvent> events_;
  std::uint64_t pairs_begun_ = 0, pairs_ended_ = 0;
  std::uint64_t region_changes_ = 0;
};

}  // namespace tessera::local
