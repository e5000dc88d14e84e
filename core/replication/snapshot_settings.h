// Settings of snapshots: precision and sizes, each with its unit, its reason, and what breaks if it changes. Both ends
// must agree: they are part of the protocol version.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/world/scene.h"

namespace tessera::replication {

// Bytes of a datagram on the wire besides the snapshot in it: IPv4, UDP, the seal's header and tag.
inline constexpr int kDatagramOverheadBytes = 28 + 24;

struct SnapshotSettings {
  // Position resolution, m. Half of it is the error seen by a client.
  double position_step_m = 1.0 / 1024;
  // Bits for each of the three smallest quaternion components; 11 bits err by at most .12 degrees.
  int orientation_bits = 11;
  // Velocity resolution, m/s and rad/s: only extrapolation uses it.
  double linear_velocity_step_m_s = 1.0 / 64;
  double angular_velocity_step_rad_s = 1.0 / 32;
  // Ticks a second, and gravity along y: bodies are predicted by them, and velocities follow from positions.
  double tick_rate_hz = 60;
  double gravity_m_s2 = -9.81;
  // Largest datagram: with the seal's header and tag, and UDP's and IPv4's headers, it stays within an MTU of 1200.
  std::size_t max_datagram_bytes = 1148;
  // Changes of a body kept as baselines: an acknowledgement of an older one (2 s at 30 a second) falls back to a full
  // record.
  std::size_t history_ticks = 64;

  // The rest is the sender's alone.

  // Ticks between two datagrams to a client that is up to date: they only show that the world goes on. Well below the
  // quarter second after which a client takes it to stand (client_sdk/playout_clock.cpp).
  std::uint64_t idle_ticks = 12;
  // How far around its own body a client sees the world, m; 0: all of it. A body that it sees stays in view up to a
  // sixth further, so that nothing flickers at the edge.
  double interest_radius_m = 0;
  // Within this distance of the own body, m, velocities are sent: a client needs them for bodies that it predicts, not
  // for those that it only shows. A client whose place nobody knows is sent all velocities.
  double velocity_radius_m = 12;
  // Bytes a second to one client, from all regions together, overhead of the datagrams included. 10 Mbit/s: a plaza of
  // 2000 moving bodies, all in view, at 30 a second takes about a third of it.
  double client_bytes_per_s = 1'250'000;
};

// The settings that regions and clients of a scene use.
inline SnapshotSettings SnapshotSettingsFor(const Scene& scene) {
  SnapshotSettings settings;
  settings.tick_rate_hz = scene.tick_rate_hz;
  settings.gravity_m_s2 = scene.gravity_m_s2.y;
  settings.interest_radius_m = scene.view.radius_m;
  settings.client_bytes_per_s = scene.view.bytes_per_s;
  return settings;
}

}  // namespace tessera::replication
