// The class TesseraWorld as scripts see it: its methods, properties and signals, given to the engine.
//
// Thread rule: the engine's main thread.
#pragma once

namespace godot_plugin {

void RegisterWorld();
void UnregisterWorld();

}  // namespace godot_plugin
