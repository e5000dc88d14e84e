// RecordingRelay: stands between one dialler and a port of this machine, passes datagrams both ways, and keeps those of
// the dialler, as somebody on the network between would.
//
//   RecordingRelay relay(7801);
//   ... dial relay.port() ...
//   relay.Stop();
//   EXPECT_FALSE(relay.Replay().opened);   // all of it once more, from the same address
//
// Thread rule: one thread; a thread of its own passes on. CommandError: no socket is to be had.
#pragma once

#include <atomic>
#include <cstdint>
#include <thread>
#include <vector>

namespace tessera::support {

class RecordingRelay {
 public:
  explicit RecordingRelay(std::uint16_t to);
  ~RecordingRelay();
  RecordingRelay(const RecordingRelay&) = delete;
  RecordingRelay& operator=(const RecordingRelay&) = delete;

  std::uint16_t port() const { return port_; }
  // Nothing is passed on any more.
  void Stop();

  struct Replayed {
    int logins = 0, sealed = 0;  // how many of each kind were recorded
    bool answered = false;       // the port is there: it answers the hello, which comes last
    // It sent something sealed. A login that comes again soon is accepted anew, by keys that its sender never had.
    bool opened = false;
  };
  // After Stop.
  Replayed Replay() const;

 private:
  using Datagram = std::vector<std::uint8_t>;
  void Pass();

  const int front_, back_;
  std::uint16_t port_ = 0;
  std::atomic<bool> stopped_ = false;
  std::vector<Datagram> recorded_;  // the thread's until Stop
  std::thread thread_;
};

}  // namespace tessera::support
