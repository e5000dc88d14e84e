// Now: the time, passed in and never read. Spans and deadlines use the steady clock; times that people and certificates
// see use the wall clock.
#pragma once

#include <chrono>

#include "google/protobuf/timestamp.pb.h"

namespace tessera::control {

using Steady = std::chrono::nanoseconds;  // since an arbitrary start

struct Now {
  Steady steady{0};
  std::chrono::nanoseconds unix_time{0};
};

inline google::protobuf::Timestamp ToTimestamp(std::chrono::nanoseconds unix_time) {
  google::protobuf::Timestamp stamp;
  const auto seconds = std::chrono::floor<std::chrono::seconds>(unix_time);
  stamp.set_seconds(seconds.count());
  stamp.set_nanos(static_cast<int>((unix_time - seconds).count()));
  return stamp;
}

inline std::chrono::nanoseconds FromTimestamp(const google::protobuf::Timestamp& stamp) {
  return std::chrono::seconds(stamp.seconds()) + std::chrono::nanoseconds(stamp.nanos());
}

}  // namespace tessera::control
