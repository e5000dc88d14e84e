// CommandError: what a command could not do, in one line. Caught in main alone, which prints it and exits 1.
#pragma once

#include <stdexcept>

namespace tessera::local {

class CommandError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace tessera::local
