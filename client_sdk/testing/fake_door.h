// FakeDoor: a players' door in JSON whose answers a test writes, at a Unix socket or by TLS on this machine.
//
//   FakeDoor door(folder.path() + "/control.sock.json", [](const auto& path, const auto& body) {
//     return FakeDoor::Http(200, R"({"instances": []})");
//   });
//
// Thread rule: the answerer is called by the door's own thread, one request at a time; the destructor waits for it.
#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <signal.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cctype>
#include <functional>
#include <string>
#include <thread>
#include <utility>

namespace tessera::client {

class FakeDoor {
 public:
  // Gives all bytes that go back over the connection, which closes then.
  using Answerer = std::function<std::string(const std::string& path, const std::string& body)>;
  // A connection as bytes: a socket, or TLS over it. Read gives at most `size`; 0 or less: it is over.
  struct Stream {
    std::function<ssize_t(char* bytes, std::size_t size)> read;
    std::function<void(const std::string& bytes)> write;
  };
  // Begins the connection, which it keeps until the stream is gone. A stream without functions: it did not come about.
  using Opener = std::function<Stream(int socket)>;

  FakeDoor(const std::string& path, Answerer answerer) : answerer_(std::move(answerer)), opener_(&Plain) {
    sockaddr_un at{};
    at.sun_family = AF_UNIX;
    EXPECT_LT(path.size(), sizeof at.sun_path);
    std::copy(path.begin(), path.end(), at.sun_path);
    Listen(AF_UNIX, reinterpret_cast<const sockaddr*>(&at), sizeof at);
  }
  // On a free port of 127.0.0.1.
  FakeDoor(Opener opener, Answerer answerer) : answerer_(std::move(answerer)), opener_(std::move(opener)) {
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    Listen(AF_INET, reinterpret_cast<const sockaddr*>(&at), sizeof at);
    socklen_t size = sizeof at;
    EXPECT_EQ(getsockname(listening_, reinterpret_cast<sockaddr*>(&at), &size), 0);
    port_ = ntohs(at.sin_port);
  }
  ~FakeDoor() {
    const std::uint64_t one = 1;
    EXPECT_EQ(write(end_, &one, sizeof one), static_cast<ssize_t>(sizeof one));
    thread_.join();
    close(listening_);
    close(end_);
  }
  FakeDoor(const FakeDoor&) = delete;
  FakeDoor& operator=(const FakeDoor&) = delete;

  std::string address() const { return "127.0.0.1:" + std::to_string(port_); }
  int requests() const { return requests_; }

  static std::string Http(int status, const std::string& body) {
    return "HTTP/1.1 " + std::to_string(status) +
           " x\r\nContent-Type: application/json\r\nContent-Length: " + std::to_string(body.size()) +
           "\r\nConnection: close\r\n\r\n" + body;
  }
  static Stream Plain(int socket) {
    return {[socket](char* bytes, std::size_t size) { return recv(socket, bytes, size, 0); },
            [socket](const std::string& bytes) {
              for (std::size_t at = 0; at < bytes.size();) {
                const ssize_t sent = send(socket, bytes.data() + at, bytes.size() - at, MSG_NOSIGNAL);
                if (sent <= 0) return;
                at += static_cast<std::size_t>(sent);
              }
            }};
  }

 private:
  void Listen(int family, const sockaddr* at, socklen_t size) {
    listening_ = socket(family, SOCK_STREAM | SOCK_CLOEXEC, 0);
    EXPECT_EQ(bind(listening_, at, size), 0);
    EXPECT_EQ(listen(listening_, 16), 0);
    thread_ = std::thread([this] { Serve(); });
  }
  void Serve() {
    // A server that is left in the middle of a handshake still has something to write.
    sigset_t broken_pipe;
    sigemptyset(&broken_pipe);
    sigaddset(&broken_pipe, SIGPIPE);
    pthread_sigmask(SIG_BLOCK, &broken_pipe, nullptr);
    for (;;) {
      pollfd waited[2] = {{.fd = listening_, .events = POLLIN, .revents = 0},
                          {.fd = end_, .events = POLLIN, .revents = 0}};
      if (poll(waited, 2, -1) < 0 || waited[1].revents != 0) return;
      const int connection = accept4(listening_, nullptr, nullptr, SOCK_CLOEXEC);
      if (connection < 0) continue;
      const timeval patience{.tv_sec = 10, .tv_usec = 0};
      setsockopt(connection, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
      setsockopt(connection, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
      Converse(connection);
      close(connection);
    }
  }
  void Converse(int connection) {
    const Stream stream = opener_(connection);
    if (!stream.read) return;
    std::string all;
    std::size_t begin = std::string::npos, length = 0;
    char bytes[4096];
    while (begin == std::string::npos || all.size() < begin + length) {
      const ssize_t size = stream.read(bytes, sizeof bytes);
      if (size <= 0) return;
      all.append(bytes, static_cast<std::size_t>(size));
      if (begin != std::string::npos) continue;
      begin = all.find("\r\n\r\n");
      if (begin == std::string::npos) continue;
      begin += 4;
      length = LengthIn(all.substr(0, begin));
    }
    const std::size_t path = all.find(' ') + 1;
    ++requests_;
    stream.write(answerer_(all.substr(path, all.find(' ', path) - path), all.substr(begin, length)));
  }
  static std::size_t LengthIn(std::string headers) {
    std::transform(headers.begin(), headers.end(), headers.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    const std::string name = "\r\ncontent-length: ";
    const std::size_t at = headers.find(name);
    return at == std::string::npos ? 0 : std::stoul(headers.substr(at + name.size()));
  }

  Answerer answerer_;
  Opener opener_;
  int listening_ = -1, end_ = eventfd(0, EFD_CLOEXEC);
  int port_ = 0;
  std::atomic<int> requests_ = 0;
  std::thread thread_;
};

}  // namespace tessera::client
