// By which address a stranger is counted: an IPv4 address, also in IPv6's form, as it is; an IPv6 address by its first
// 64 bits, for whoever has one of these has them all. Thread rule: free functions on values.
#pragma once

#include <string>

namespace tessera::control {

// The peer of a connected socket: 4 or 8 bytes. Empty: it has no such address.
std::string CountedAddress(int socket_fd);
// The same of a peer as gRPC names it: "ipv4:192.0.2.7:5000", "ipv6:%5B2001:db8::1%5D:5000". A name of another form
// counts as it is.
std::string CountedPeer(const std::string& peer);

}  // namespace tessera::control
