#include "game_sdk/native/native_module.h"

#include <dlfcn.h>

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <filesystem>
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

constexpr char kEntry[] = "tessera_game_module_1", kMovementEntry[] = "tessera_movement_1";

// Valid functions of a library: those of a game, a movement, or both.
struct Opened {
  const tessera_game_module* functions = nullptr;  // null: it is no game
  const tessera_movement* movement = nullptr;
};

// A library of this process, by its name.
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

int RunNative(void* game, tessera_game_call* call, const tessera_game_callback* event, tessera_game_error* error) {
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

absl::Status CheckFunctions(const tessera_game_module* functions) {
  if (functions == nullptr) return absl::FailedPreconditionError(absl::StrCat(kEntry, " returned nothing"));
  if (functions->abi != TESSERA_GAME_ABI) {
    return absl::FailedPreconditionError(absl::StrCat("is made for version ", functions->abi,
                                                      " of the interface, and this is version ", TESSERA_GAME_ABI));
  }
  if (functions->size < offsetof(tessera_game_module, movement)) {
    return absl::FailedPreconditionError(
        absl::StrCat("has a table of ", functions->size, " bytes, of ", sizeof(tessera_game_module)));
  }
  return absl::OkStatus();
}

// All that the library has. A game's movement is in its table.
absl::StatusOr<Opened> FunctionsOf(void* library) {
  const auto entry = reinterpret_cast<tessera_game_module_1_function>(dlsym(library, kEntry));
  const auto movement_entry = reinterpret_cast<tessera_movement_1_function>(dlsym(library, kMovementEntry));
  Opened opened;
  if (entry != nullptr) {
    opened.functions = entry();
    if (absl::Status status = CheckFunctions(opened.functions); !status.ok()) return status;
    opened.movement = MovementOfModule(*opened.functions);
  } else if (movement_entry != nullptr) {
    opened.movement = movement_entry();
    if (opened.movement == nullptr) {
      return absl::FailedPreconditionError(absl::StrCat(kMovementEntry, " returned nothing"));
    }
  } else {
    return absl::FailedPreconditionError(absl::StrCat("has no function ", kEntry));
  }
  if (opened.movement == nullptr) return opened;
  const absl::Status status = CheckMovement(*opened.movement);
  if (!status.ok()) return absl::FailedPreconditionError(status.message());
  return opened;
}

absl::StatusOr<Opened> Open(const std::string& path) {
  void* const library = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) return absl::FailedPreconditionError(absl::StrCat("cannot be loaded: ", dlerror()));
  absl::StatusOr<Opened> opened = FunctionsOf(library);
  if (!opened.ok()) dlclose(library);
  return opened;
}

absl::Status Lacks(const NativeModule& module, absl::string_view what) {
  return absl::FailedPreconditionError(absl::StrCat("game module ", module.name(), ": ", what));
}

}  // namespace

NativeModule::NativeModule(std::string name, std::string hash, bool is_game, const tessera_movement* movement)
    : name_(std::move(name)),
      hash_(std::move(hash)),
      movement_(movement),
      watched_{sizeof(tessera_game_module),
               TESSERA_GAME_ABI,
               is_game ? LoadNative : nullptr,
               is_game ? UnloadNative : nullptr,
               is_game ? HandlesNative : nullptr,
               is_game ? RunNative : nullptr,
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

NativeModule::Loaded NativeModule::Load(const std::string& folder, std::string_view name, std::string_view hash) {
  Loaded loaded = LoadAny(folder, name, hash);
  if (loaded.ok() && !(*loaded)->is_game()) return Lacks(**loaded, "has a movement alone, and is no game");
  return loaded;
}

NativeModule::Loaded NativeModule::LoadMovement(const std::string& folder, std::string_view name,
                                                std::string_view hash) {
  Loaded loaded = LoadAny(folder, name, hash);
  if (loaded.ok() && (*loaded)->movement() == nullptr) return Lacks(**loaded, "has no movement");
  return loaded;
}

NativeModule::Loaded NativeModule::LoadMovementFile(const std::string& path) {
  const std::filesystem::path file = path;
  if (file.extension() != ".so") return absl::InvalidArgumentError(absl::StrCat(path, ": is no .so"));
  const std::string folder = file.has_parent_path() ? file.parent_path().string() : ".";
  return LoadMovement(folder, file.stem().string());
}

NativeModule::Loaded NativeModule::LoadAny(const std::string& folder, std::string_view name, std::string_view hash) {
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
  absl::StatusOr<Opened> opened = absl::InternalError("");
  {
    const CrashNote note(owned.c_str(), nullptr, nullptr);
    opened = Open(path);
  }
  if (!opened.ok()) {
    return absl::Status(opened.status().code(), absl::StrCat("game module ", shown, ": ", opened.status().message()));
  }
  std::shared_ptr<const NativeModule> module(
      new NativeModule(owned, std::move(build), opened->functions != nullptr, opened->movement));
  Libraries().emplace(owned, Library{module, opened->functions});
  return module;
}

}  // namespace tessera::game
