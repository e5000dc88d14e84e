// absl::CHexEscape on the standard library; see README.md. Thread rule: free functions on values.
#pragma once

// NOLINTBEGIN(readability-identifier-naming): names are those of Abseil

#include <string>
#include <string_view>

namespace absl {

inline std::string CHexEscape(std::string_view text) {
  constexpr char kDigits[] = "0123456789abcdef";
  std::string out;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\' || c == '\'') {
      out += '\\';
      out += c;
    } else if (byte >= 0x20 && byte < 0x7f) {
      out += c;
    } else {
      out += "\\x";
      out += kDigits[byte >> 4];
      out += kDigits[byte & 15];
    }
  }
  return out;
}

}  // namespace absl
// NOLINTEND(readability-identifier-naming)
