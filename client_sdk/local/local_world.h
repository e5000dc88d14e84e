// LocalWorld: one region of a world in this process, with its game, without a cluster: for a single player, for
// editors, and for the tests of a game.
//
// It is the worker's own region and its way to clients, so clients see no difference; between the two are sockets of
// this machine's loopback, and nobody without a grant of this world gets in. It has no thread: time passes in Advance,
// by the caller's clock, which may be any that does not go back.
//
//   auto world = LocalWorld::Open({.scene = text, .game = lua});
//   auto client = Client::JoinByGrant(*(*world)->Grant(), {.bind_address = "127.0.0.1", ...});
//   loop: (*world)->Advance(now); (*client)->Poll(now);
//
// Thread rule: one thread at a time.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/world/ids.h"

struct tessera_movement;  // tessera/movement.h

namespace tessera::region {
class Region;
}

namespace tessera::local {

struct LocalWorldOptions {
  std::string scene;                   // JSON, or protobuf's text format
  std::string scene_name = "scene";    // as errors shall name it
  std::string game{};                  // Lua; empty: none
  std::string game_name = "game.lua";  // as its errors shall name it
  std::uint32_t snapshot_rate_hz = 0;  // at most the scene's tick rate; 0: that
  // How players' inputs move bodies, with a game or without one; it outlives the world. Null: as the scene says.
  const tessera_movement* movement = nullptr;
};

struct LocalGameLine {
  Tick tick;
  bool error = false;
  std::string text;
};

class LocalWorld {
 public:
  // INVALID_ARGUMENT: what is wrong with the scene, the movement or the game, as loading them elsewhere says it.
  // UNAVAILABLE: there is no socket.
  static absl::StatusOr<std::unique_ptr<LocalWorld>> Open(const LocalWorldOptions& options);
  ~LocalWorld();
  LocalWorld(const LocalWorld&) = delete;
  LocalWorld& operator=(const LocalWorld&) = delete;

  // Takes in what clients sent, and steps what is due: a few ticks at most, for a world that stood does not race
  // through what it missed. Error: why the world cannot go on.
  absl::Status Advance(std::chrono::steady_clock::time_point now);

  // For another player, from 1 on. FAILED_PRECONDITION: the scene has no player. RESOURCE_EXHAUSTED: kUsualPlayers.
  absl::StatusOr<std::vector<std::uint8_t>> Grant();
  // As regions would give it to clients.
  const std::vector<std::uint8_t>& packed_scene() const;

  Tick tick() const;
  // The world itself, for tests and tools; valid until the next call of Advance.
  const region::Region& region() const;
  // The oldest line of the game that was not taken yet: what it printed, or an error. The newest 1000 are kept.
  std::optional<LocalGameLine> TakeLine();

 private:
  struct Impl;
  explicit LocalWorld(std::unique_ptr<Impl> impl);

  std::unique_ptr<Impl> impl_;
};

}  // namespace tessera::local
