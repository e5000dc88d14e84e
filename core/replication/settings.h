// Settings of replication: precision and sizes, each with its unit, its reason, and what breaks if it changes. Both
// ends must agree: they are part of the protocol version.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/world/scene.h"

namespace tessera::replication {

// Bytes of a datagram on the wire besides the snapshot in it: IPv4, UDP, the seal's header and tag.
inline constexpr int kDatagramOverheadBytes = 28 + 24;

struct Settings {
  // Position resolution, m. Half of it is the error seen by a client.
  double position_step_m = 1.0 / 1024;
  // Bits for each of the three smallest quaternion components; 11 bits err by at most .12 degrees.
  int orientation_bits = 11;
  // Velocity resolution, m/s and rad/s: only extrapolation uses it.
  double linear_velocity_step_m_s = 1.0 / 64;
  double angular_velocity_step_rad_s = 1.0 / 32;
  // Ticks a second, and what falls along y: how bodies are predicted, and how velocities follow from positions.
  double tick_rate_hz = 60;
  double gravity_m_s2 = -9.81;
  // Largest datagram: with the seal's header and tag, and UDP's and IPv4's headers, it stays within an MTU of 1200.
  std::size_t max_datagram_bytes = 1148;
  // Changes of a body kept as baselines: an acknowledgement of an older one (2 s at 30 a second) falls back to a whole
  // record.
  std::size_t history_ticks = 64;

  // The rest is the sender's alone.

  // Ticks between two datagrams to a client that has all there is to tell: they only say that the world goes on. Well
  // below the quarter second after which a client takes it to stand (client_sdk/playout_clock.cpp).
  std::uint64_t idle_ticks = 12;
  // How far around its own body a client is shown the world, m; 0: all of it. What it sees it goes on seeing up to a
  // sixth further, so that nothing flickers at the edge.
  double interest_radius_m = 0;
  // Within this much of the own body, m, velocities are told: what a client predicts itself needs them, what it only
  // shows does not. A client whose place nobody knows is told all.
  double velocity_radius_m = 12;
  // What one client is sent in all, by all regions together, overhead of the datagrams included. 10 Mbit/s: a plaza of
  // 2000 moving bodies, whole, at 30 a second takes about a third of it.
  double client_bytes_per_s = 1'250'000;
};

// What regions and clients of a scene use.
inline Settings SettingsFor(const Scene& scene) {
  Settings settings;
  settings.tick_rate_hz = scene.tick_rate_hz;
  settings.gravity_m_s2 = scene.gravity_m_s2.y;
  settings.interest_radius_m = scene.view.radius_m;
  settings.client_bytes_per_s = scene.view.bytes_per_s;
  return settings;
}

}  // namespace tessera::replication
