// The numbers of docs/viewer_protocol.md, which both ends must agree on.
#pragma once

#include <cstddef>
#include <cstdint>

namespace tessera::gateway {

inline constexpr std::uint8_t kViewerProtocolVersion = 2;
inline constexpr char kViewerSubprotocol[] = "tessera.viewer.1";

enum class MessageKind : std::uint8_t {
  kWelcome = 1,
  kShapes = 2,
  kStatics = 3,
  kMap = 4,
  kFrame = 5,
  kVisuals = 6,
  kTiles = 7
};

// A message of shapes, visuals or statics ends with the first of them by which it has half of this. Only a single large
// shape makes it longer.
inline constexpr std::size_t kMaxSceneMessage_bytes = std::size_t{1} << 20;

// Frames.
inline constexpr std::uint8_t kPausedFlag = 1, kDeferredFlag = 2;
inline constexpr std::uint8_t kTriggerFlag = 1, kKinematicFlag = 2;
inline constexpr std::uint8_t kPositionBit = 1, kOrientationBit = 2, kOwnerBit = 4, kStateBit = 8, kSpeedBit = 16;
inline constexpr std::uint8_t kAllBits = 31;
inline constexpr std::uint8_t kAsleepState = 1, kExtrapolatedState = 2, kPredictedState = 4;
inline constexpr double kPositionSteps_per_m = 1024, kSpeedSteps_per_m_s = 64;

// Limits for what a viewer sends. A page that steers sends 60 messages a second; twice that leaves room for others.
inline constexpr std::size_t kMaxViewerMessage_bytes = 4096;
inline constexpr double kViewerMessages_per_s = 120;
inline constexpr int kMaxBadMessages = 10;  // within a minute; then the viewer is closed
// Limits for a viewer's own limit of bytes: at the least a frame of some hundred bodies fits into a quarter of a
// second.
inline constexpr std::uint64_t kMinBudget_kbytes_per_s = 16, kMaxBudget_kbytes_per_s = 1'000'000;
inline constexpr std::uint32_t kMaxFrameRate_hz = 60, kFirstFrameRate_hz = 30;
// Contacts sent to a viewer in a second, and those that wait for one that reads slowly.
inline constexpr std::size_t kMaxMet_per_s = 100, kMaxMetKept = 100;
inline constexpr std::size_t kMaxEventsKept = 64;
// Limits for a recording that is played.
inline constexpr double kMinPlaySpeed = 0.1, kMaxPlaySpeed = 16, kMaxPlayTime_s = 1e9, kMaxPlaySteps = 1000;
// The most ticks that a paused world makes by one order; the control plane has the same limit.
inline constexpr std::uint64_t kMaxStepTicks = 36'000;
inline constexpr std::uint16_t kCloseStatus = 4000;

}  // namespace tessera::gateway
