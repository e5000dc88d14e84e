// CommandError: what a command could not do, in one line. Caught in main alone, which prints it and exits 1.
#pragma once

#include <stdexcept>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace tessera::local {

class CommandError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// CommandError with the message of a status that is not ok.
inline void OrThrow(const absl::Status& status) {
  if (!status.ok()) throw CommandError(std::string(status.message()));
}
template <class T>
T OrThrow(absl::StatusOr<T> value) {
  OrThrow(value.status());
  return *std::move(value);
}

}  // namespace tessera::local
