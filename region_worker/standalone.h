// Running without a control plane: its orders, worked out from the flags, the same in every worker.
//
// The instance's key is no secret, and each worker signs its own certificate with it: a standalone world is for
// loopback and debugging.
#pragma once

#include <cstdint>
#include <memory>

#include "absl/status/statusor.h"
#include "core/world/scene.h"
#include "game_sdk/native/native_module.h"
#include "net/credential.h"
#include "region_worker/core/worker_core.h"
#include "region_worker/worker_options.h"

namespace tessera::worker {

inline constexpr char kStandaloneInstanceId[] = "standalone";
inline constexpr double kMaxSeconds = 1e6;

// Credentials for such a world are signed with it.
net::SigningKey StandaloneKey();

// Not yet `run`: the worker starts by itself when it is linked and its players are there.
struct StandaloneWorld {
  std::shared_ptr<const Scene> scene;
  Order order;
  std::shared_ptr<const game::NativeModule> module = nullptr;    // null: none
  std::shared_ptr<const game::NativeModule> movement = nullptr;  // for a game in Lua; null: none
};
// Reads the scene, and loads the game's library or its movement's. `self` and `key` are the worker's, which is
// certified.
absl::StatusOr<StandaloneWorld> PrepareStandalone(const Standalone& flags, const Identity& self,
                                                  const net::VerificationKey& key);
StandaloneRules RulesOf(const Standalone& flags, const StandaloneWorld& world);

}  // namespace tessera::worker
