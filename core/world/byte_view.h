// The two views of the same bytes: messages and files are serialised to text, packets and states are bytes.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace tessera {

inline std::span<const std::uint8_t> AsBytes(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}
inline std::string_view AsText(std::span<const std::uint8_t> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace tessera
