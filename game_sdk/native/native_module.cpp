#include "game_sdk/native/native_module.h"

#include <dlfcn.h>

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <fstream>
#include <functional>
#include <map>
#include <sstream>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/world/movement.h"
#include "core/world/sha256.h"
#include "game_sdk/api/api.h"
#include "game_sdk/native/crash_note.h"

namespace tessera::game {
namespace {

constexpr char kEntry[] = "tessera_game_module_1";

// A library of this process, by the game's name.
struct Library {
  std::shared_ptr<const NativeModule> module;
  const tessera_game_module* functions;
};
std::map<std::string, Library, std::less<>>& Libraries() {
  static std::map<std::string, Library, std::less<>> libraries;
  return libraries;
}

// A game of a library. The interface gives `load` nothing but the source, whose name is the library's.
struct NativeGame {
  const tessera_game_module* functions;
  std::string name;
  void* game;
};

int LoadNative(const tessera_game_host* host, const tessera_game_source* source, void** game,
               tessera_game_error* error) {
  const auto library = Libraries().find(std::string_view(source->name));
  if (library == Libraries().end()) {
    std::snprintf(error->text, sizeof error->text, "game module %.63s: is not loaded", source->name);
    return 1;
  }
  const tessera_game_module* const functions = library->second.functions;
  auto native = std::make_unique<NativeGame>(NativeGame{functions, source->name, nullptr});
  const CrashNote note(native->name.c_str(), nullptr, nullptr);
  if (const int status = functions->load(host, source, &native->game, error); status != 0) return status;
  *game = native.release();
  return 0;
}

void UnloadNative(void* game) {
  const std::unique_ptr<NativeGame> native(static_cast<NativeGame*>(game));
  const CrashNote note(native->name.c_str(), nullptr, nullptr);
  native->functions->unload(native->game);
}

int HandlesNative(const void* game, std::uint32_t callback, const char* kind) {
  const auto& native = *static_cast<const NativeGame*>(game);
  const CrashNote note(native.name.c_str(), nullptr, nullptr);
  return native.functions->handles(native.game, callback, kind);
}

int RunNative(void* game, tessera_game_call* call, const tessera_game_event* event, tessera_game_error* error) {
  const auto& native = *static_cast<const NativeGame*>(game);
  const Callback* const callback = FindCallback(event->callback);
  const CrashNote note(native.name.c_str(), callback == nullptr ? "a callback" : callback->name.data(), event->kind);
  return native.functions->run(native.game, call, event, error);
}

absl::StatusOr<std::string> ReadLibrary(const std::string& path, std::string_view name) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file) {
    return absl::NotFoundError(
        absl::StrCat("game module ", absl::string_view(name.data(), name.size()), ": ", path, " cannot be read"));
  }
  if (file.tellg() > static_cast<std::streamoff>(kMaxModuleBytes)) {
    return absl::FailedPreconditionError(absl::StrCat("game module ", absl::string_view(name.data(), name.size()),
                                                      ": has more than ", kMaxModuleBytes, " bytes"));
  }
  file.seekg(0);
  std::ostringstream bytes;
  bytes << file.rdbuf();
  return std::move(bytes).str();
}

// A library that was built before there were movements has a shorter table.
const tessera_movement* MovementOfModule(const tessera_game_module& functions) {
  const bool has = functions.size >= offsetof(tessera_game_module, movement) + sizeof functions.movement;
  return has ? functions.movement : nullptr;
}

// The library's functions.
absl::StatusOr<const tessera_game_module*> Open(const std::string& path) {
  void* const library = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) return absl::FailedPreconditionError(absl::StrCat("cannot be loaded: ", dlerror()));
  const auto entry = reinterpret_cast<tessera_game_module_1_function>(dlsym(library, kEntry));
  const tessera_game_module* const functions = entry == nullptr ? nullptr : entry();
  absl::Status status;
  if (entry == nullptr) {
    status = absl::FailedPreconditionError(absl::StrCat("has no function ", kEntry));
  } else if (functions == nullptr) {
    status = absl::FailedPreconditionError(absl::StrCat(kEntry, " returned nothing"));
  } else if (functions->abi != TESSERA_GAME_ABI) {
    status = absl::FailedPreconditionError(absl::StrCat("is made for version ", functions->abi,
                                                        " of the interface, and this is version ", TESSERA_GAME_ABI));
  } else if (functions->size < offsetof(tessera_game_module, movement)) {
    status = absl::FailedPreconditionError(
        absl::StrCat("has a table of ", functions->size, " bytes, of ", sizeof(tessera_game_module)));
  } else if (const tessera_movement* movement = MovementOfModule(*functions); movement != nullptr) {
    status = CheckMovement(*movement);
    if (!status.ok()) status = absl::FailedPreconditionError(status.message());
  }
  if (status.ok()) return functions;
  dlclose(library);
  return status;
}

}  // namespace

NativeModule::NativeModule(std::string name, std::string hash, const tessera_movement* movement)
    : name_(std::move(name)),
      hash_(std::move(hash)),
      movement_(movement),
      watched_{sizeof(tessera_game_module),
               TESSERA_GAME_ABI,
               LoadNative,
               UnloadNative,
               HandlesNative,
               RunNative,
               movement == nullptr ? nullptr : &watched_movement_} {
  if (movement == nullptr) return;
  watched_movement_ = *movement;
  watched_movement_.size = sizeof watched_movement_;
  watched_movement_.move = MoveNative;
  watched_movement_.user = this;
}

int NativeModule::MoveNative(const tessera_movement_tick* tick, void* state, tessera_movement_push* push) {
  const auto& native = *static_cast<const NativeModule*>(tick->user);
  const CrashNote note(native.name_.c_str(), "its movement", nullptr);
  tessera_movement_tick own = *tick;
  own.user = native.movement_->user;
  return native.movement_->move(&own, state, push);
}

absl::StatusOr<std::shared_ptr<const NativeModule>> NativeModule::Load(const std::string& folder, std::string_view name,
                                                                       std::string_view hash) {
  if (absl::Status status = CheckModuleName(name); !status.ok()) return status;
  const absl::string_view shown(name.data(), name.size());
  const std::string path = absl::StrCat(folder, "/", shown, ".so");
  const absl::StatusOr<std::string> bytes = ReadLibrary(path, name);
  if (!bytes.ok()) return bytes.status();
  std::string build = Sha256Hex(*bytes);
  const auto other = [&](absl::string_view what, std::string_view wanted) {
    return absl::FailedPreconditionError(
        absl::StrCat("game module ", shown, ": this host has build ", build.substr(0, 12), ", and ", what, " build ",
                     absl::string_view(wanted.data(), std::min<std::size_t>(wanted.size(), 12))));
  };
  if (!hash.empty() && hash != build) return other("the world runs", hash);
  if (const auto known = Libraries().find(name); known != Libraries().end()) {
    if (known->second.module->hash() != build) return other("this process", known->second.module->hash());
    return known->second.module;
  }
  InstallCrashNote();
  const std::string owned(name);
  absl::StatusOr<const tessera_game_module*> functions = absl::InternalError("");
  {
    const CrashNote note(owned.c_str(), nullptr, nullptr);
    functions = Open(path);
  }
  if (!functions.ok()) {
    return absl::Status(functions.status().code(),
                        absl::StrCat("game module ", shown, ": ", functions.status().message()));
  }
  std::shared_ptr<const NativeModule> module(new NativeModule(owned, std::move(build), MovementOfModule(**functions)));
  Libraries().emplace(owned, Library{module, *functions});
  return module;
}

}  // namespace tessera::game
