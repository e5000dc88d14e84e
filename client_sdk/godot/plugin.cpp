// The plug-in's one symbol, by which the engine begins (sample/tessera.gdextension names it).
#include <cstdio>

#include "engine.h"
#include "registration.h"

namespace godot_plugin {
namespace {

void Initialize(void*, std::int32_t level) {
  if (level == abi::kSceneLevel) RegisterWorld();
}

void Deinitialize(void*, std::int32_t level) {
  if (level == abi::kSceneLevel) UnregisterWorld();
}

}  // namespace
}  // namespace godot_plugin

// 0: the engine is one that the plug-in cannot work with.
extern "C" __attribute__((visibility("default"))) std::uint8_t tessera_godot_init(
    godot_plugin::abi::GetFunction get, void* library, godot_plugin::abi::Initialization* initialization) {
  const char* missing = nullptr;
  if (!godot_plugin::Engine().Load(get, library, missing)) {
    std::fprintf(stderr,
                 "tessera: this engine is older than Godot 4.2, or built without deprecated functions: it has no %s\n",
                 missing);
    return 0;
  }
  *initialization = {godot_plugin::abi::kSceneLevel, nullptr, godot_plugin::Initialize, godot_plugin::Deinitialize};
  return 1;
}
