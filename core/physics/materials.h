// How the materials of two touching bodies combine.
#pragma once

namespace tessera::physics {

// Tells Bullet our rules: friction by geometric mean, restitution by the larger, rolling and spinning friction by the
// larger. Bullet keeps one rule for the whole process; calling this again changes nothing. Any thread.
void InstallMaterialRules();

}  // namespace tessera::physics
