// Names of native games: shared libraries that the operators of hosts put there, and that worlds run by name.
//
//   auto game = ParseNativeGame("native:arena@9f86d081...");     // name "arena", hash "9f86d081..."
//   NativeGameText("arena", hash)                                // "native:arena@9f86d081"
//
// Thread rule: plain values and free functions.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace tessera::game {

// Begins the text that names a native game, where the name of a file could stand as well.
inline constexpr std::string_view kNativePrefix = "native:";
// Begins the line that a process writes as it dies in one: "died in game module arena: Segmentation fault in on_tick".
inline constexpr std::string_view kDiedInModule = "died in game module ";
// Modules that one host offers. More, and what agents tell of themselves is no small message any more.
inline constexpr std::size_t kMaxGameModules = 64;

// INVALID_ARGUMENT: a name is 1 to 63 letters, digits, '_' and '-'; so it names no folder.
absl::Status CheckModuleName(std::string_view name);
// SHA-256 as everywhere here: 64 lower-case hexadecimal digits.
bool IsModuleHash(std::string_view text);

struct NativeGameName {
  std::string name;
  std::string hash;  // the build that is meant; empty: any
};
bool IsNativeGame(std::string_view text);
// INVALID_ARGUMENT says what is wrong with the name or with the hash.
absl::StatusOr<NativeGameName> ParseNativeGame(std::string_view text);
// For people: with the first 8 digits of the hash, if there is one.
std::string NativeGameText(std::string_view name, std::string_view hash);

// The text that follows kDiedInModule in the line; empty if it is no such line.
std::string_view DeathInModule(std::string_view line);

}  // namespace tessera::game
