// The largest gRPC message between a control plane and those who dial it, and between an agent and its workers.
#pragma once

namespace tessera::trust {

// Bytes, the same at both ends: gRPC's own limit of 4 MB for what a client receives is less than a world of a thousand
// regions or ten thousand players has in one answer. A scene of a million scattered-out bodies is 64 MB on the wire;
// more goes in pieces. Higher, and one message of an agent costs the control plane more memory.
inline constexpr int kMaxMessageBytes = 64 << 20;

}  // namespace tessera::trust
