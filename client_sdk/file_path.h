// File paths: a name as callers of the C interface give it, in UTF-8, as a path of this system, and back. Where paths
// are bytes, as on Linux, nothing is changed, and any bytes will do. Thread rule: none.
#pragma once

#include <filesystem>
#include <string>

namespace tessera::client {

inline std::filesystem::path FilePath(const std::string& text) { return {std::u8string(text.begin(), text.end())}; }

inline std::string TextOf(const std::filesystem::path& path) {
  const std::u8string text = path.u8string();
  return {text.begin(), text.end()};
}

}  // namespace tessera::client
