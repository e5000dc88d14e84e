// Structures that stand by friction and balance: Kapla tower (scene 8), card house, arch, dominoes.
//
// Body 1 is the ground. Pure functions, any thread.
#pragma once

#include "core/world/scene.h"

namespace tessera::scenes {

// Scene 8: a round tower of 6 floors on 8 pairs of uprights; 102 blocks of one size.
inline constexpr int kKaplaFloors = 6, kKaplaBase = 8;
Scene KaplaTower();
double KaplaHeight_m();  // top of the highest block

// 5 storeys of leaning cards (2 cm x 40 cm x 20 cm); 40 of them.
Scene CardHouse();

// An arch of 16 wedges over 12 m, with a load of four bars.
Scene Arch();

// 181 tiles in a ring that closes on itself as a spiral; the first is pushed over. Tile i is body i + 2.
inline constexpr int kDominoes = 181;
Scene Dominoes();

}  // namespace tessera::scenes
