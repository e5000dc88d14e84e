// Serial numbers of a host's certificates. The first one's is drawn at random when the host joins; those that take its
// place have the same digits and four more behind, which count them: "9f...3c", "9f...3c0001", "9f...3c0002".
//
// The store has the newest that the host has shown. Earlier ones are worth nothing, and a later one is taken: the
// authority signed it for this host alone, so a control plane that begins from an old backup knows its hosts still.
//
// Thread rule: free functions on values.
#pragma once

#include <string>
#include <string_view>

namespace tessera::control {

// The one after it; empty: it is none of a host's, or the last one.
std::string NextHostSerial(std::string_view serial);
// How many came before it.
unsigned RenewalsOf(std::string_view serial);
// Whether `shown` counts for a host of which the store has `stored`.
bool CountsAsSerial(std::string_view shown, std::string_view stored);

}  // namespace tessera::control
