// KeptConnection: an HTTP connection that stays open between requests, for tests of what a server holds for it.
//
//   KeptConnection connection(loop.address());
//   connection.Ask("GET", "/healthz");
//   connection.Head();
//
// Thread rule: one thread.
#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdint>
#include <string>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"

namespace tessera::gateway {

// It reads no more than it is asked to.
class KeptConnection {
 public:
  explicit KeptConnection(const std::string& address) : address_(address) {
    const std::size_t colon = address.rfind(':');
    std::uint32_t port = 0;
    sockaddr_in to{};
    to.sin_family = AF_INET;
    EXPECT_TRUE(absl::SimpleAtoi(address.substr(colon + 1), &port));
    to.sin_port = htons(static_cast<std::uint16_t>(port));
    inet_pton(AF_INET, address.substr(0, colon).c_str(), &to.sin_addr);
    socket_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const timeval patience{.tv_sec = 30, .tv_usec = 0};
    setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    EXPECT_EQ(connect(socket_, reinterpret_cast<const sockaddr*>(&to), sizeof to), 0);
  }
  ~KeptConnection() { close(socket_); }
  KeptConnection(const KeptConnection&) = delete;
  KeptConnection& operator=(const KeptConnection&) = delete;

  void Ask(const std::string& method, const std::string& path) {
    const std::string text = absl::StrCat(method, " ", path, " HTTP/1.1\r\nHost: ", address_, "\r\n\r\n");
    EXPECT_EQ(send(socket_, text.data(), text.size(), MSG_NOSIGNAL), static_cast<ssize_t>(text.size()));
  }
  // The next answer's head; its length is that which it states.
  std::string Head() {
    while (received_.find("\r\n\r\n") == std::string::npos) {
      if (!More()) return "";
    }
    const std::size_t end = received_.find("\r\n\r\n") + 4;
    std::string head = received_.substr(0, end);
    received_.erase(0, end);
    return head;
  }
  std::string Body(std::size_t size) {
    while (received_.size() < size) {
      if (!More()) break;
    }
    std::string body = received_.substr(0, size);
    received_.erase(0, size);
    return body;
  }

 private:
  bool More() {
    std::string piece(std::size_t{1} << 14, '\0');
    const ssize_t got = recv(socket_, piece.data(), piece.size(), 0);
    if (got > 0) received_.append(piece, 0, static_cast<std::size_t>(got));
    return got > 0;
  }

  std::string address_, received_;
  int socket_ = -1;
};

}  // namespace tessera::gateway
