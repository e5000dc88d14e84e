// AddSanitizerOption: an option of a sanitizer for the programs that a test starts from now on. Where they are built
// without that sanitizer, it means nothing.
#pragma once

#include <cstdlib>
#include <string>

namespace tessera::support {

// "ASAN_OPTIONS", "quarantine_size_mb=1".
inline void AddSanitizerOption(const char* variable, const std::string& option) {
  const char* const given = std::getenv(variable);
  setenv(variable, (given == nullptr ? option : given + (":" + option)).c_str(), 1);
}

}  // namespace tessera::support
