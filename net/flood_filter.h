// FloodFilter: lets the kernel drop what a port would drop anyway, before it wakes anybody or takes room in the
// socket's buffer. It is a classic BPF program on the socket, made anew when what it drops changes; without a flood
// there is none. Where the kernel takes no such program all is as before, only dearer.
//
// Datagrams without proof are of four kinds: hellos that have the instance's knock, those of strangers, logins and the
// others (challenges, accepts, refusals, unknown ones). When more of a kind come than are looked at, the kernel passes
// a random share of them; the rate of all is known from the share. So strangers' hellos keep out nobody who has a
// grant. Sealed datagrams pass, for they may be a player's, except from ends that are shut out, and from those of
// sessions that send far beyond their budget: of these a share passes likewise, for the port would drop the rest before
// it opens them.
//
//   FloodFilter filter(socket);
//   filter.Open(KnockOf(instance_key));
//   for (SessionNumber session : acceptor.TakeExceeding()) filter.Limit(now, session, its end, its limit, received);
//   filter.Measure(now, acceptor.unproven(), received_of);  // acts each kUpdate
//   filter.ShutOut(now, address);
//
// Thread rule: one thread; time comes in.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>

#include "net/acceptor.h"
#include "net/address.h"
#include "net/limits.h"
#include "net/sockets.h"

namespace tessera::net {

class FloodFilter {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;
  static constexpr std::chrono::milliseconds kUpdate{100};

  explicit FloodFilter(SystemSocket socket) : socket_(socket) {}
  FloodFilter(const FloodFilter&) = delete;
  FloodFilter& operator=(const FloodFilter&) = delete;

  // `seen`: the datagrams that the socket gave, since the start; `received_of`: those of a session, as
  // Acceptor::ReceivedOf. Nothing: it has ended, and with it its limit.
  void Measure(TimePoint now, const UnprovenDatagrams& seen,
               const std::function<std::optional<std::uint64_t>(SessionNumber)>& received_of);
  // From now on hellos with this knock are no strangers'.
  void Open(const Knock& knock);
  // From now on a share of what this end sends passes, until that is not above `most_per_s` any more. `received`: as
  // above, by now. Repeating it does nothing.
  void Limit(TimePoint now, SessionNumber session, const Address& end, double most_per_s, std::uint64_t received);
  void ShutOut(TimePoint now, const Address& address);

  bool active() const { return active_; }
  // Shares of hellos that pass, with the knock and without: 0 to 1.
  double hellos_that_pass() const { return hellos_.passes; }
  double strangers_that_pass() const { return strangers_.passes; }
  std::size_t limited() const { return limited_.size(); }  // ends of sessions

 private:
  struct Kind {
    double most_per_s;
    double passes = 1;  // the share, 0 to 1
    std::uint64_t seen = 0;
  };
  struct End {
    Address address;
    TimePoint until;
  };

  struct Limited {
    SessionNumber session;
    Address end;
    Kind kind;
    TimePoint since;
  };

  // Whether it changed much.
  static bool Adapt(Kind& kind, std::uint64_t seen, double passed_s);
  void Apply();

  SystemSocket socket_;
  std::optional<Knock> knock_;
  Kind hellos_{.most_per_s = kHellos.per_s}, strangers_{.most_per_s = kStrangersHellos.per_s},
      logins_{.most_per_s = kUnproven_per_s}, others_{.most_per_s = kUnproven_per_s};
  std::deque<End> shut_out_;     // the first to end first
  std::deque<Limited> limited_;  // the eldest first
  TimePoint measured_{};
  bool active_ = false;
};

}  // namespace tessera::net
