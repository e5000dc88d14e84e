// AddAsanOption: an option of the address sanitizer for the programs that a test starts from now on. Where they are
// built without it, it means nothing.
#pragma once

#include <cstdlib>
#include <string>

namespace tessera::support {

// "quarantine_size_mb=1".
inline void AddAsanOption(const std::string& option) {
  const char* const given = std::getenv("ASAN_OPTIONS");
  setenv("ASAN_OPTIONS", (given == nullptr ? option : given + (":" + option)).c_str(), 1);
}

}  // namespace tessera::support
