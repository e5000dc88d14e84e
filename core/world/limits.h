// Limits of a world: what outside input is held to. Each with its unit, its reason, and what breaks if it changes.
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
// Players of one instance; one ENet host serves at most 4095 peers.
inline constexpr std::uint32_t kMaxPlayers = 1024;
// Steps a second. Below 10 stacks fall; above 240 float positions lose the increments of slow bodies.
inline constexpr std::uint32_t kMinTickRateHz = 10, kMaxTickRateHz = 240;
// Furthest coordinate, m. Doubles resolve 2 nm here.
inline constexpr double kMaxCoordinate_m = 1e7;
// Extents of one shape, m: thinner falls through the collision margin, larger swamps float coordinates.
inline constexpr double kMinExtent_m = 1e-3, kMaxExtent_m = 1e5;
// Mass of a dynamic body, kg.
inline constexpr double kMinMass_kg = 1e-6, kMaxMass_kg = 1e9;
// A given moment of inertia against the mass, m^2: that of a grain of the least extent, and of two mountains as far
// apart as the parts of a compound may be. What lies beyond turns at a touch, or never.
inline constexpr double kMinInertiaOfMass_m2 = kMinExtent_m * kMinExtent_m / 10;
inline constexpr double kMaxInertiaOfMass_m2 = kMaxExtent_m * kMaxExtent_m * 10;
// Speeds a scene or an input may ask for. Faster bodies cross a region in one tick.
inline constexpr double kMaxSpeed_m_s = 1e4, kMaxAngularSpeed_rad_s = 1e3;
// Gravity, fields, and players' forces by their bodies' mass: beyond, one tick moves a body further than it is long.
inline constexpr double kMaxAcceleration_m_s2 = 1e4;
// Forces and torques of motors and players, spring constants, in SI units. Squares of it still fit a float.
inline constexpr double kMaxForce = 1e15;
// What a state may hold once a world runs: far more than a scene may ask for, since impacts and long falls add up. A
// body beyond is as good as lost (a float has steps of metres there): its owner takes it out and reports it, and a
// frame that shows one is refused.
inline constexpr double kMaxStatePosition_m = 1e8;
inline constexpr double kMaxStateSpeed_m_s = 1e5, kMaxStateAngularSpeed_rad_s = 1e5;
// kg m^2/s: the largest inertia at that speed, about. Its square does not fit a float.
inline constexpr double kMaxStateAngularMomentum = 1e27;
// What one pair of bodies may do to each other in one tick, N s and N m s: the largest mass and inertia, stopped from
// those speeds.
inline constexpr double kMaxImpulse = 1e15, kMaxAngularImpulse = 1e27;
// A gear's ratio, either way: 1 / ratio is used as well.
inline constexpr double kMinGearRatio = 1e-6, kMaxGearRatio = 1e6;
// Of what one client may be sent, bytes a second: below, not even the own body gets through; above is no network.
inline constexpr double kMinViewBytes_per_s = 8e3, kMaxViewBytes_per_s = 1e9;
// Fields of one scene. Each is reckoned for each body in each tick.
inline constexpr std::size_t kMaxFields = 256;
inline constexpr double kMaxFriction = 10;
// How far a quaternion's or a normal's length may be from 1 before it is taken for a mistake.
inline constexpr double kUnitTolerance = 1e-3;
inline constexpr std::size_t kMaxHullPoints = 255;
inline constexpr std::size_t kMaxCompoundChildren = 255;
inline constexpr std::size_t kMaxMeshVertices = 1'000'000, kMaxMeshTriangles = 2'000'000;
// Characters of a name, so that an error that quotes it stays one line.
inline constexpr std::size_t kMaxNameLength = 63;
// Text of a scene, bytes: protobuf's parsers take no more than 2 GB, and a million bodies written out need about 200
// MB.
inline constexpr std::size_t kMaxSceneText = std::size_t{512} << 20;

}  // namespace tessera
