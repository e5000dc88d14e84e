// A world in this process, in C++17: tessera.hpp with the functions of local.h. Header only.
//
//   tessera::LocalWorld world;
//   if (tessera::Error error = world.Open({scene_text, game_text})) return Fail(error.text);
//   tessera::Client client;
//   client.JoinLocal(world);
//   while (running) {
//     world.Advance();
//     client.Poll();
//   }
#ifndef TESSERA_LOCAL_HPP_
#define TESSERA_LOCAL_HPP_

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "local.h"
#include "tessera.hpp"

namespace tessera {

struct LocalOptions {
  std::string scene;                   // JSON or textproto
  std::string game{};                  // Lua; empty: none
  std::string scene_name = "scene";    // with which errors begin
  std::string game_name = "game.lua";  // likewise
  std::uint32_t snapshot_rate_hz = 0;  // 0: the scene's tick rate
  // How players' inputs move bodies, in the world and in its clients' prediction; null: as the scene says.
  const tessera_movement* movement = nullptr;
};

class LocalWorld {
 public:
  // Closes the one before.
  Error Open(const LocalOptions& options) {
    tessera_local_options given = TESSERA_LOCAL_OPTIONS;
    given.snapshot_rate_hz = options.snapshot_rate_hz;
    given.scene = options.scene.data();
    given.scene_size = options.scene.size();
    given.scene_name = options.scene_name.c_str();
    given.game = options.game.empty() ? nullptr : options.game.data();
    given.game_size = options.game.size();
    given.game_name = options.game_name.c_str();
    given.movement = options.movement;
    tessera_local* opened = nullptr;
    const Error error = Error::Of(tessera_local_world(&given, &opened));
    world_.reset(opened);
    return error;
  }
  // Steps what is due: once a frame, before the clients' Poll.
  Error Advance(std::int64_t now_ns = tessera_now()) { return Error::Of(tessera_local_advance(get(), now_ns)); }
  std::uint64_t Tick() const { return tessera_local_tick(get()); }
  // Lines that the game has printed since the last call, and its errors.
  std::vector<std::string> TakeLines() {
    std::vector<std::string> lines;
    while (const char* line = tessera_local_line(get())) lines.emplace_back(line);
    return lines;
  }
  void Close() { world_.reset(); }
  tessera_local* get() const { return world_.get(); }

 private:
  struct Closer {
    void operator()(tessera_local* world) const { tessera_local_close(world); }
  };
  std::unique_ptr<tessera_local, Closer> world_;
};

inline Error Client::JoinLocal(LocalWorld& world, const GrantOptions& options) {
  tessera_grant_options given = TESSERA_GRANT_OPTIONS;
  given.deadline_ms = static_cast<std::uint32_t>(options.deadline.count());
  given.flags = options.predict ? std::uint32_t{TESSERA_JOIN_PREDICT} : 0;
  tessera_client* joined = nullptr;
  const Error error = Error::Of(tessera_local_join(world.get(), &given, &joined));
  client_.reset(joined);
  return error;
}

}  // namespace tessera

#endif
