// ScriptWorld: a world as the script of a test acts on it, by plain calls that say why they failed and throw nothing,
// so that Lua may raise the error.
//
// Thread rule: one thread.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "game_sdk/testing/lockstep_world.h"

namespace tessera::game {

// Instructions that a script may take between two steps; some 5 s.
inline constexpr std::uint64_t kMaxScriptWork = 1'000'000'000;

struct Placing {
  const double* position = nullptr;  // 3 numbers each, 4 of the rotation; nullptr: as it is
  const double* rotation = nullptr;
  const double* velocity = nullptr;
  const double* spin = nullptr;
};

class ScriptWorld {
 public:
  explicit ScriptWorld(std::unique_ptr<LockstepWorld> world) : world_(std::move(world)) {}

  // Each returns whether it succeeded; error() says why not.
  bool Step();
  bool Kill(BodyId body);
  bool Place(BodyId body, const Placing& placing);
  bool Join(std::string_view name, BodyId& body);
  bool Command(BodyId body, std::string_view bytes);
  // Those since the last call; valid until the next.
  bool TakeEvents(BodyId body);
  const std::vector<LockstepWorld::Event>& events() const { return events_; }
  // nullptr: the game did not send the player away.
  const std::string* EndedBecause(BodyId body) const;
  bool Leave(BodyId body);
  bool Input(BodyId body, const double* force_n, const double* torque_nm);
  // `steering`: everything but force and torque.
  bool Steer(BodyId body, const PlayerInput& steering);
  bool FindBody(BodyId body);
  bool FindBody(std::string_view name, BodyId& body);
  // The bodies of a kind, or all where it is nullptr, ascending; valid until the next call. Fails for a kind that the
  // scene does not have.
  bool ListBodies(const std::string_view* kind);
  const std::vector<BodyId>& bodies() const { return bodies_; }
  const std::string& error() const { return error_; }

  const LockstepWorld& world() const { return *world_; }
  // The lines and errors of the game since the test began.
  const std::vector<std::string>& lines() const { return lines_; }
  const std::vector<std::string>& errors() const { return errors_; }
  // From now on an error of the game does not fail a step.
  void AllowErrors() { errors_allowed_ = true; }
  // The lines that the script printed.
  const std::vector<std::string>& output() const { return output_; }
  // Hash and tick of the world after each step.
  const std::vector<std::uint64_t>& hashes() const { return hashes_; }
  const std::vector<std::uint64_t>& ticks() const { return ticks_; }

  // The host that scripts call; a tessera_game_call is a ScriptWorld.
  static const tessera_game_host& Host();
  tessera_game_call* AsCall() { return reinterpret_cast<tessera_game_call*>(this); }
  static ScriptWorld& Of(tessera_game_call* call) { return *reinterpret_cast<ScriptWorld*>(call); }

 private:
  static int CallFromScript(tessera_game_call* call, std::uint32_t function, const tessera_game_value* arguments,
                            std::uint32_t count, tessera_game_value* result);
  static const char* ErrorOf(const tessera_game_call* call);
  static int Charge(tessera_game_call* call, std::uint64_t instructions);
  bool Note(const absl::Status& status);
  bool Refuse(std::string why);

  std::unique_ptr<LockstepWorld> world_;
  bool errors_allowed_ = false;
  std::uint64_t work_ = 0;  // since the last step
  std::string error_;
  KeptValue result_;
  std::vector<BodyId> bodies_;
  std::vector<LockstepWorld::Event> events_;
  std::vector<std::string> lines_, errors_, output_;
  std::vector<std::uint64_t> hashes_, ticks_;
};

}  // namespace tessera::game
