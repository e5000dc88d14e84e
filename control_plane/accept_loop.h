// AcceptLoop: a thread that accepts connections at listening sockets and hands each on.
//
//   AcceptLoop loop({listening}, [&](int fd) { grpc::AddInsecureChannelFromFd(server, fd); }, [] {});
//
// It waits while this program has no descriptor left, rather than spin. Thread rule: `take` and `rest` run on the
// loop's own thread, one at a time, and not after the destructor.
#pragma once

#include <atomic>
#include <functional>
#include <thread>
#include <vector>

namespace tessera::control {

class AcceptLoop {
 public:
  using Take = std::function<void(int fd)>;  // owns it from then on; it does not block
  using Rest = std::function<void()>;        // called about once a second

  // Owns `listening`, which do not block.
  AcceptLoop(std::vector<int> listening, Take take, Rest rest);
  // The sockets are closed then; connections that were accepted stay.
  ~AcceptLoop();
  AcceptLoop(const AcceptLoop&) = delete;
  AcceptLoop& operator=(const AcceptLoop&) = delete;

 private:
  void Run();
  bool Accept(int listening);

  const std::vector<int> listening_;
  const Take take_;
  const Rest rest_;
  const int stop_;  // wakes it to end; -1 where there was no descriptor left for it, and it ends within a second
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace tessera::control
