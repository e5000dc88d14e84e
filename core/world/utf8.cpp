#include "core/world/utf8.h"

#include <cstddef>

namespace tessera {
namespace {

bool IsIn(unsigned char byte, unsigned char lowest, unsigned char highest) { return byte >= lowest && byte <= highest; }

// Bytes of the character that `text` begins with; 0 if it begins with none. RFC 3629, section 4: a second byte that
// makes the form too long, a surrogate or a number above U+10FFFF is not one.
std::size_t CharacterBytes(std::string_view text) {
  const auto byte = [&](std::size_t i) {
    return i < text.size() ? static_cast<unsigned char>(text[i]) : static_cast<unsigned char>(0);
  };
  const auto continues = [&](std::size_t i) { return IsIn(byte(i), 0x80, 0xBF); };
  const unsigned char lead = byte(0);
  if (lead < 0x80) return 1;
  if (IsIn(lead, 0xC2, 0xDF)) return continues(1) ? 2 : 0;
  if (IsIn(lead, 0xE0, 0xEF)) {
    const bool second = IsIn(byte(1), lead == 0xE0 ? 0xA0 : 0x80, lead == 0xED ? 0x9F : 0xBF);
    return second && continues(2) ? 3 : 0;
  }
  if (IsIn(lead, 0xF0, 0xF4)) {
    const bool second = IsIn(byte(1), lead == 0xF0 ? 0x90 : 0x80, lead == 0xF4 ? 0x8F : 0xBF);
    return second && continues(2) && continues(3) ? 4 : 0;
  }
  return 0;
}

}  // namespace

bool IsUtf8(std::string_view text) {
  while (!text.empty()) {
    const std::size_t bytes = CharacterBytes(text);
    if (bytes == 0) return false;
    text.remove_prefix(bytes);
  }
  return true;
}

std::string ValidUtf8(std::string_view text) {
  std::string valid;
  valid.reserve(text.size());
  while (!text.empty()) {
    const std::size_t bytes = CharacterBytes(text);
    valid += bytes == 0 ? std::string_view("?") : text.substr(0, bytes);
    text.remove_prefix(bytes == 0 ? 1 : bytes);
  }
  return valid;
}

}  // namespace tessera
