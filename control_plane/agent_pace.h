// AgentPace: how fast the messages of an agent's stream are read.
//
//   AgentPace pace(Clock::now());
//   while (reader.Read(&message)) {
//     ...
//     std::this_thread::sleep_for(pace.Pause(Clock::now(), reader.bytes()));
//   }
//
// An agent that says more waits by gRPC's flow control: nothing of it is lost, its heartbeats wait in the same line,
// and a host whose heartbeats wait too long is LOST. It begins at the rate, without a burst: else dialling anew would
// give one each time. Thread rule: one thread; time comes in.
#pragma once

#include <chrono>
#include <cstddef>

#include "net/token_bucket.h"

namespace tessera::control {

// Messages a second, and at once after a rest. A worker says two a second, and up to twenty where events happen in its
// game and no neighbour renews its lease, which 250 of a host may do. Lower, and such a host's heartbeats wait; higher,
// and operators wait for one that was taken over.
inline constexpr net::Rate kAgentMessages{.per_s = 5'000, .burst = 10'000};
// A message counts as one, and as one more for each so many bytes: 80 MB a second, the bodies of four full regions.
inline constexpr std::size_t kBytesOfAMessage = std::size_t{16} << 10;

class AgentPace {
 public:
  // Shorter ones add up: a thread that sleeps for each of five thousand messages does little else.
  static constexpr std::chrono::milliseconds kShortestPause{5};

  explicit AgentPace(net::TokenBucket::TimePoint now, const net::Rate& rate = kAgentMessages) : rate_(rate) {
    messages_.Fill(now, rate_);
    messages_.Spend(rate_.burst);
  }

  // How long nothing more may be read, after a message of so many bytes.
  std::chrono::nanoseconds Pause(net::TokenBucket::TimePoint now, std::size_t bytes) {
    messages_.Fill(now, rate_);
    messages_.Spend(1 + static_cast<double>(bytes / kBytesOfAMessage));
    const std::chrono::duration<double> debt(-messages_.left() / rate_.per_s);
    if (debt < kShortestPause) return {};
    return std::chrono::ceil<std::chrono::nanoseconds>(debt);
  }

 private:
  const net::Rate rate_;
  net::TokenBucket messages_;
};

}  // namespace tessera::control
