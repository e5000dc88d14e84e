// libtessera-connect, where it stands beside the plug-in: for development, as no game ships it. It is loaded when an
// address is given, and not before.
#pragma once

#include <tessera/tessera.h>

#include <cstdint>
#include <string>
#include <vector>

namespace godot_plugin {

// Asks a control plane for a grant, as a game's backend does; waits for it. An error is also tessera_last_error.
tessera_code GetGrant(const std::string& address, const std::string& instance, const std::string& player,
                      std::vector<std::uint8_t>& grant);

}  // namespace godot_plugin
