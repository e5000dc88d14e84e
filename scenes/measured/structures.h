// Structures that stand by friction and balance: Kapla tower (scene 8), card house, arch, dominoes.
//
// Body 1 is the ground. Pure functions, any thread.
#pragma once

#include "core/world/scene.h"

namespace tessera::scenes {

// Scene 8: a long house of 6 floors; each 8 sleepers side by side, with 9 planks along its sides upon them. It has
// 102 blocks of 10 kg; the last body is on the topmost floor.
inline constexpr int kKaplaFloors = 6, kKaplaBase = 8;
inline constexpr double kKaplaLayer_m = 0.1;  // two to a floor
Scene KaplaTower();

// 5 storeys of leaning cards (1 cm x 40 cm x 20 cm), with shorter ones lying between the storeys; 40 in all.
Scene CardHouse();
inline constexpr int kCards = 40;

// A parabolic arch of 17 wedges over 12 m, 6 m high, that bears four bars on its keystone. The wedges come first, from
// one foot to the other.
inline constexpr int kArchWedges = 17, kArchBars = 4;
Scene Arch();

// 181 tiles in a ring that closes on itself as a spiral; the first is pushed over. Tile i is body i + 2.
inline constexpr int kDominoes = 181;
Scene Dominoes();

}  // namespace tessera::scenes
