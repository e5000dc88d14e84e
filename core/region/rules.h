// Rules: what two regions must have in common, beside the scene, for a border between them to be none: the settings
// that say what is relevant and handed over, and the version of the engine. Servers with different physics settings
// were a known way for such worlds to come apart; here each sends the other its rules before the first frame.
//
// Thread rule: free function on values.
#pragma once

#include <cstdint>

#include "core/region/settings.h"

namespace tessera::region {

// Version of the physics, frames and exchange: grows with every change after which two versions come to other states,
// as core/physics/golden.txt shows it, or to other states of scenes that the older one could not read.
inline constexpr std::uint32_t kEngineVersion = 12;

// The same number on every host. Never 0, which stands for no rules.
std::uint64_t RulesOf(const RegionSettings& settings);

}  // namespace tessera::region
