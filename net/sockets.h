// Sockets: all that the network asks of the system itself, beside what ENet asks. No other source of the client library
// names a function of a system (cmake/system_calls.awk holds that), so sockets_linux.cpp and sockets_windows.cpp are
// all that differs between the two.
//
//   if (const auto fault = TryBind(address)) return fault->text;
//   SendNow(socket, to, bytes);              // lost where the socket does not take it, as on any network
//
// Only on Linux does the kernel drop by rules and say how many datagrams it dropped; elsewhere those calls say that it
// cannot be had, and a port under a flood is dearer.
// Thread rule: none of its own; a socket belongs to one thread. Only LookUpHost waits.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "net/address.h"
#include "net/handshake.h"
#include "net/protocol.h"

namespace tessera::net {

#ifdef _WIN32
using SystemSocket = std::uintptr_t;
#else
using SystemSocket = int;
#endif

struct SocketFault {
  enum class Kind : std::uint8_t { kInUse, kNoSuchAddress, kNoPrivilege, kOther };
  Kind kind = Kind::kOther;
  std::string text;  // the system's own words
};

// --- Addresses ---
std::optional<std::uint32_t> HostFrom(const std::string& text);  // "127.0.0.1"; network byte order, as in Address
// An IPv4 address or a name. Errors: INVALID_ARGUMENT "host ...".
absl::StatusOr<std::uint32_t> LookUpHost(const std::string& host);

// --- Whether a socket could, tried by one that is closed again ---
std::optional<SocketFault> TryBind(const Address& address);
std::optional<SocketFault> TryRoute(const Address& to);  // sends nothing
// Why a call of ENet's on this thread failed: ForgetFault before, LastFault after. Out of memory where nothing is
// noted.
void ForgetFault();
SocketFault LastFault();

// --- Of an open socket ---
// Asks for buffers of so many bytes each; the system may give less.
void RaiseBuffers(SystemSocket socket, int bytes);
void SendNow(SystemSocket socket, const Address& to, std::span<const std::uint8_t> bytes);

struct OutgoingDatagram {
  Address to;
  std::size_t size = 0;
  std::array<std::uint8_t, kMaxUdpBytes> bytes;
};
inline constexpr std::size_t kMaxSentAtOnce =
    16;  // more would not stay in the nearest cache from sealing until sending
// At most kMaxSentAtOnce, by one call of the system where it has one for that.
void SendNow(SystemSocket socket, std::span<OutgoingDatagram> datagrams);

// Datagrams for this socket that were dropped before it, modulo 2^32, where the system says so.
std::optional<std::uint32_t> KernelDrops(SystemSocket socket);

// Rules by which the system drops datagrams before they reach a socket.
struct DropRules {
  std::vector<Address> shut_out;  // all datagrams of these ends
  struct Limited {
    Address end;
    double passes = 1;  // share of its datagrams, 0 to 1
  };
  std::vector<Limited> limited;
  std::optional<Knock> knock;  // left out: all hellos are strangers'
  // Shares that pass, 0 to 1, of datagrams without proof; others pass.
  double hellos = 1, strangers = 1, logins = 1, others = 1;
};
// Returns false where the system takes no such rules: all passes.
bool SetDropRules(SystemSocket socket, const DropRules& rules);
void ClearDropRules(SystemSocket socket);

}  // namespace tessera::net
