// How a control plane that follows another one says where the leader is: in the trailing metadata of every call that it
// refuses, as HOST:PORT. It is a hint, of use to those whom the cluster's authority lets believe it.
#pragma once

namespace tessera::trust {

inline constexpr char kLeaderHeader[] = "tessera-leader";

}  // namespace tessera::trust
