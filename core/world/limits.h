// Limits of a world, which all outside input must keep. Each has its unit, its reason, and what breaks if it changes.
#pragma once

#include <cstddef>
#include <cstdint>

namespace tessera {

// A map lists every region, and placement looks at all pairs of neighbours; beyond this both need another form.
inline constexpr std::uint32_t kMaxRegions = 1000;
// A map's index may take its square / 4 entries, 16 MB here.
inline constexpr std::size_t kMaxCells = 4096;
// Bodies of one scene, scattered ones included. A snapshot index and the encoder's tables are sized by it.
inline constexpr std::size_t kMaxBodies = 1'000'000;
inline constexpr std::size_t kMaxJoints = 1'000'000;
// Kinds of a scene's bodies, and the bytes of a kind's name. A game has callbacks for each.
inline constexpr std::size_t kMaxKinds = 256, kMaxKindLength = 32;
// Collision layers of a scene, and the bytes of a layer's name. A set of layers is a mask of 32 bits.
inline constexpr std::size_t kMaxLayers = 32, kMaxLayerLength = 32;
// Players of one instance, and how many it takes unless told. Each order names all of them, and a region's ENet host,
// which looks at the places of all its peers in every tick, has at most 4095.
inline constexpr std::uint32_t kMaxPlayers = 10'000, kUsualPlayers = 1024;
// Steps a second. Below 10 stacks fall; above 240 float positions lose the increments of slow bodies.
inline constexpr std::uint32_t kMinTickRateHz = 10, kMaxTickRateHz = 240;
// Furthest coordinate, m. Doubles resolve 2 nm here.
inline constexpr double kMaxCoordinate_m = 1e7;
// Extents of one shape, m. A thinner shape falls through the collision margin, a larger one swamps float coordinates.
inline constexpr double kMinExtent_m = 1e-3, kMaxExtent_m = 1e5;
// Mass of a dynamic body, kg.
inline constexpr double kMinMass_kg = 1e-6, kMaxMass_kg = 1e9;
// Range of a given moment of inertia by the mass, m^2: from a grain of the least extent to two mountains as far apart
// as the parts of a compound may be. A body beyond it turns at a touch, or never.
inline constexpr double kMinInertiaOfMass_m2 = kMinExtent_m * kMinExtent_m / 10;
inline constexpr double kMaxInertiaOfMass_m2 = kMaxExtent_m * kMaxExtent_m * 10;
// Speeds a scene or an input may ask for. Faster bodies cross a region in one tick.
inline constexpr double kMaxSpeed_m_s = 1e4, kMaxAngularSpeed_rad_s = 1e3;
// Limit of gravity, of fields, and of a player's force by the mass of its body. Beyond it, one tick moves a body
// further than it is long.
inline constexpr double kMaxAcceleration_m_s2 = 1e4;
// Forces and torques of motors and players, spring constants, in SI units. Squares of it still fit a float.
inline constexpr double kMaxForce = 1e15;
// Limits of a state once a world runs: far more than a scene may ask for, since impacts and long falls add up. A body
// beyond them is as good as lost (a float has steps of metres there): its owner takes it out and reports it, and a
// frame that shows one is refused.
inline constexpr double kMaxStatePosition_m = 1e8;
inline constexpr double kMaxStateSpeed_m_s = 1e5, kMaxStateAngularSpeed_rad_s = 1e5;
// kg m^2/s: the largest inertia at that speed, about. Its square does not fit a float.
inline constexpr double kMaxStateAngularMomentum = 1e27;
// Largest impulse between two bodies in one tick, N s and N m s: it stops the largest mass and inertia from those
// speeds.
inline constexpr double kMaxImpulse = 1e15, kMaxAngularImpulse = 1e27;
// Largest ratio of a gear, and 1 / the least: solving uses both the ratio and its inverse.
inline constexpr double kMinGearRatio = 1e-6, kMaxGearRatio = 1e6;
// Range of the rate at which one client is sent data, bytes a second. Below it not even the own body gets through;
// beyond it there is no network.
inline constexpr double kMinViewBytes_per_s = 8e3, kMaxViewBytes_per_s = 1e9;
// Fields of one scene. Each is computed for each body in each tick.
inline constexpr std::size_t kMaxFields = 256;
inline constexpr double kMaxFriction = 10;
// Paths of kinematic bodies: points of one, their times, s, and the mean speeds between them. At 10 Hz, the slowest
// tick rate, a body turns by a radian a tick then; beyond half a turn the shortest way would be the wrong one. A loop
// ends where it begins but for rounding.
inline constexpr std::size_t kMaxPathPoints = 1024;
inline constexpr double kMinPathTime_s = 1e-2, kMaxPathTime_s = 1e6;
inline constexpr double kMinPathSpeed_m_s = 1e-4, kMaxPathSpeed_m_s = 100, kMaxPathSpin_rad_s = 10;
inline constexpr double kLoopTolerance_m = 1e-6, kLoopTolerance_rad = 1e-4;
// The length of a quaternion or a normal may differ from 1 by this much before it counts as a mistake.
inline constexpr double kUnitTolerance = 1e-3;
inline constexpr std::size_t kMaxHullPoints = 255;
inline constexpr std::size_t kMaxCompoundChildren = 255;
inline constexpr std::size_t kMaxMeshVertices = 1'000'000, kMaxMeshTriangles = 2'000'000;
// Samples of a height field: 1025 x 1025, the usual size of a terrain of 2^10 cells a side. They are 4 MB of a scene,
// and a client that predicts builds two million triangles of them at joining.
inline constexpr std::size_t kMaxHeightSamples = std::size_t{1025} * 1025;
// Meshes that are drawn in place of one shape, and their scale. An exporter may write millimetres.
inline constexpr std::size_t kMaxVisuals = 64;
inline constexpr double kMinVisualScale = 1e-6, kMaxVisualScale = 1e6;
// The file that holds them: a page loads all of it at once, and keeps it in the graphics card's memory.
inline constexpr std::size_t kMaxVisualFile_bytes = std::size_t{64} << 20, kMaxVisualTriangles = 1'000'000;
// Characters of a name, so that an error that quotes it stays one line.
inline constexpr std::size_t kMaxNameLength = 63;
// Text of a scene, bytes: protobuf's parsers take no more than 2 GB, and a million bodies written out need about 200
// MB.
inline constexpr std::size_t kMaxSceneText = std::size_t{512} << 20;

}  // namespace tessera
