// What happens to a contact point between its finding and its solving: materials combine, and edges inside a surface
// are smoothed out.
#pragma once

namespace tessera::physics {

// Tells Bullet our rules: friction by geometric mean, restitution by the larger, rolling and spinning friction by the
// larger. Bullet keeps one rule for the whole process; calling this again changes nothing. Any thread.
// A point on an edge that a mesh's or height field's triangle shares with a neighbour gets a normal that lies between
// those of the two; else what rolls over a flat surface is tripped at every edge.
void InstallContactRules();

}  // namespace tessera::physics
