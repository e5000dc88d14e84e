#include "scenes/measured/golden.h"

#include "scenes/measured/balls.h"
#include "scenes/measured/builder.h"
#include "scenes/measured/crowds.h"
#include "scenes/measured/flight.h"
#include "scenes/measured/impacts.h"
#include "scenes/measured/linkages.h"
#include "scenes/measured/stacks.h"
#include "scenes/measured/structures.h"

namespace tessera::scenes {
namespace {

constexpr GoldenScene kGolden[] = {
    {"t_handle", [] { return THandle(); }, 600},
    {"top", [] { return MakeSpinningTop().scene; }, 120},
    {"tower", [] { return Tower(20, 0.01, 3); }, 300},
    {"pyramid", [] { return Pyramid(6); }, 200},
    {"rain", [] { return Rain(120, kDenseSpacing_m); }, 240},
    {"chain", [] { return BallAndChain(100, 16).scene; }, 240},
    {"hinge_motor", [] { return HingeMotor(); }, 240},
    {"ragdolls", [] { return Ragdolls(4); }, 240},
    {"cylinders", [] { return ShapeStack(CylinderOf(0.5, 0.5), 1, 1, 6); }, 240},
    {"hulls", [] { return ShapeStack(EightSidedPrism(0.5, 0.5), 1, 1, 6); }, 240},
    {"mesh", [] { return ConvexOnMesh(5, 2); }, 240},
    {"bounce", [] { return Bounce(); }, 240},
    {"elastic", [] { return BallPile(true); }, 120},
    {"ccd", [] { return ShotAtGuardedBoxes(0.3).scene; }, 60},
    {"dominoes", [] { return Dominoes(); }, 240},
    {"asleep",
     [] {
       Scene scene = Pyramid(3);
       AllowSleep(scene, true);
       return scene;
     },
     600},
    {"heavy_load", [] { return HeavyLoadStack({.lean_rad = 0.0175, .aside_m = 0.1}); }, 240},
};

}  // namespace

std::span<const GoldenScene> GoldenScenes() { return kGolden; }

}  // namespace tessera::scenes
