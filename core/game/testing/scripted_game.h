// ScriptedGame: a game module whose callbacks are functions of a test.
//
//   game.On(kOnBodyContact, "crate", [](GameCalls& calls, auto arguments) { return calls.Call(kBodySet, {...}); });
//   GameHost::Load(game.module(), ...)
//
// A callback returns whether it succeeded. There is one ScriptedGame at a time.
#pragma once

#include <cstring>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/game/value.h"
#include "game_sdk/include/tessera/game.h"

namespace tessera::game {

// The host as a callback sees it.
class GameCalls {
 public:
  GameCalls(const tessera_game_host& host, tessera_game_call* call) : host_(host), call_(call) {}
  // Whether the function succeeded; what it returned is in result().
  bool Call(std::uint32_t function, const std::vector<GameValue>& arguments) {
    std::vector<tessera_game_value> values;
    values.reserve(arguments.size());
    for (const GameValue& argument : arguments) values.push_back(ToInterface(argument));
    return CallRaw(function, values);
  }
  bool CallRaw(std::uint32_t function, std::span<const tessera_game_value> values) {
    result_ = {};
    return host_.call(call_, function, values.data(), static_cast<std::uint32_t>(values.size()), &result_) == 0;
  }
  const tessera_game_value& result() const { return result_; }
  std::string error() const { return host_.error(call_); }
  bool Charge(std::uint64_t instructions) { return host_.charge(call_, instructions) == 0; }

 private:
  const tessera_game_host& host_;
  tessera_game_call* call_;
  tessera_game_value result_{};
};

class ScriptedGame {
 public:
  using Arguments = std::span<const tessera_game_value>;
  using Handler = std::function<bool(GameCalls&, Arguments)>;

  ScriptedGame() { current_ = this; }
  ~ScriptedGame() { current_ = nullptr; }
  ScriptedGame(const ScriptedGame&) = delete;
  ScriptedGame& operator=(const ScriptedGame&) = delete;

  void On(std::uint32_t callback, const std::string& kind, Handler handler) {
    handlers_[{callback, kind}] = std::move(handler);
  }
  tessera_game_module module() const {
    return {sizeof(tessera_game_module), TESSERA_GAME_ABI, Load, Unload, Handles, Run, nullptr};
  }
  int loads() const { return loads_; }

 private:
  static int Load(const tessera_game_host* host, const tessera_game_source* source, void** game,
                  tessera_game_error* error) {
    if (std::string_view(source->bytes, source->byte_count) == "broken") {
      std::strncpy(error->text, "game.lua:1: it is broken", sizeof error->text);
      return 1;
    }
    ++current_->loads_;
    current_->host_ = host;
    *game = current_;
    return 0;
  }
  static void Unload(void*) {}
  static int Handles(const void*, std::uint32_t callback, const char* kind) {
    return current_->handlers_.contains({callback, kind == nullptr ? "" : kind}) ? 1 : 0;
  }
  static int Run(void*, tessera_game_call* call, const tessera_game_callback* event, tessera_game_error* error) {
    GameCalls calls(*current_->host_, call);
    const Handler& handler = current_->handlers_.at({event->callback, event->kind == nullptr ? "" : event->kind});
    if (handler(calls, {event->arguments, event->count})) return 0;
    std::strncpy(error->text, "game.lua:7: it failed", sizeof error->text);
    return 1;
  }

  inline static ScriptedGame* current_ = nullptr;
  std::map<std::pair<std::uint32_t, std::string>, Handler> handlers_;
  const tessera_game_host* host_ = nullptr;
  int loads_ = 0;
};

}  // namespace tessera::game
