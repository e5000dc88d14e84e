// Settings of replication: precision and sizes, each with its unit, its reason, and what breaks if it changes. Both
// ends must agree: they are part of the protocol version.
#pragma once

#include <cstddef>
#include <cstdint>

namespace tessera::replication {

struct Settings {
  // Position resolution, m. Half of it is the error seen by a client.
  double position_step_m = 1.0 / 1024;
  // Bits for each of the three smallest quaternion components; 11 bits err by at most .12 degrees.
  int orientation_bits = 11;
  // Velocity resolution, m/s and rad/s: only extrapolation uses it.
  double linear_velocity_step_m_s = 1.0 / 64;
  double angular_velocity_step_rad_s = 1.0 / 32;
  // Ticks a second. Only scales how far a body is predicted from its baseline: a wrong one costs bits, not truth.
  double tick_rate_hz = 60;
  // Largest datagram: mtu 1200 less ENet's headers and the AEAD's tag, so that ENet never fragments it.
  std::size_t max_datagram_bytes = 1148;
  // Ticks kept as baselines: an acknowledgement older than this (2 s at 30 a second) falls back to full.
  std::size_t history_ticks = 64;
  // Ticks between two datagrams to a client that has all there is to tell: they only say that the world goes on. Well
  // below the quarter second after which a client takes it to stand (client_sdk/playout_clock.cpp); the sender's alone.
  std::uint64_t idle_ticks = 12;
};

}  // namespace tessera::replication
