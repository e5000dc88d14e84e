// The checksum of files that workers, agents and the control plane give each other.
#pragma once

#include <string>
#include <string_view>

namespace tessera {

// SHA-256 (FIPS 180-4) in 64 lower-case hexadecimal digits.
std::string Sha256Hex(std::string_view bytes);

}  // namespace tessera
