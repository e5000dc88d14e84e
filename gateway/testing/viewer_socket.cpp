#include "gateway/testing/viewer_socket.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <stdexcept>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "gateway/viewer_format.h"

namespace tessera::gateway {
namespace {

std::uint64_t BigEndian(std::string_view bytes) {
  std::uint64_t value = 0;
  for (const char byte : bytes) value = value << 8 | static_cast<std::uint8_t>(byte);
  return value;
}

}  // namespace

ViewerSocket::ViewerSocket(const std::string& address, const std::string& instance, const Options& options)
    : on_binary_(options.on_binary), on_text_(options.on_text) {
  const std::size_t colon = address.rfind(':');
  std::uint32_t port = 0;
  sockaddr_in to{};
  to.sin_family = AF_INET;
  if (!absl::SimpleAtoi(address.substr(colon + 1), &port) ||
      inet_pton(AF_INET, address.substr(0, colon).c_str(), &to.sin_addr) != 1) {
    throw std::runtime_error("address: " + address);
  }
  to.sin_port = htons(static_cast<std::uint16_t>(port));
  socket_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (options.receive_buffer_bytes > 0) {
    setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &options.receive_buffer_bytes, sizeof options.receive_buffer_bytes);
  }
  if (connect(socket_, reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0) {
    throw std::runtime_error("cannot connect to " + address);
  }
  const std::string path = options.path.empty() ? "/watch/" + instance : options.path;
  SendBytes(absl::StrCat("GET ", path, " HTTP/1.1\r\nHost: ", options.host.empty() ? address : options.host,
                         "\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n",
                         "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Protocol: ", kViewerSubprotocol,
                         "\r\n", options.origin.empty() ? "" : absl::StrCat("Origin: ", options.origin, "\r\n"),
                         "\r\n"));
}

ViewerSocket::~ViewerSocket() { close(socket_); }

void ViewerSocket::SendBytes(std::string_view rest) {
  while (!rest.empty()) {
    const ssize_t sent = send(socket_, rest.data(), rest.size(), MSG_NOSIGNAL);
    if (sent <= 0) return;  // the other end has closed, which the next Take sees
    rest.remove_prefix(static_cast<std::size_t>(sent));
  }
}

// Masked, as a browser's frames are; a mask of zeros is one.
void ViewerSocket::SendFrame(std::uint8_t opcode, std::string_view payload) {
  std::string frame(1, static_cast<char>(0x80 | opcode));
  if (payload.size() < 126) {
    frame.push_back(static_cast<char>(0x80 | payload.size()));
  } else {
    frame.push_back(static_cast<char>(0x80 | 127));
    for (int shift = 56; shift >= 0; shift -= 8) frame.push_back(static_cast<char>(payload.size() >> shift & 0xff));
  }
  frame.append(4, '\0');
  frame.append(payload);
  SendBytes(frame);
}

bool ViewerSocket::Until(const std::function<bool()>& holds, std::chrono::milliseconds patience) {
  const auto deadline = std::chrono::steady_clock::now() + patience;
  while (!holds()) {
    if (closed || std::chrono::steady_clock::now() > deadline) return holds();
    Take(std::chrono::milliseconds(50));
  }
  return true;
}

std::size_t ViewerSocket::Take(std::chrono::milliseconds wait, std::size_t most) {
  if (closed) return 0;
  pollfd readable{.fd = socket_, .events = POLLIN, .revents = 0};
  if (poll(&readable, 1, static_cast<int>(wait.count())) <= 0) return 0;
  std::string more(std::min(most, kTake_bytes), '\0');
  const ssize_t got = recv(socket_, more.data(), more.size(), 0);
  if (got <= 0) {
    closed.emplace();
    return 0;
  }
  received_.append(more, 0, static_cast<std::size_t>(got));
  if (!upgraded_) ReadAnswer();
  if (upgraded_) ReadFrames();
  return static_cast<std::size_t>(got);
}

void ViewerSocket::ReadAnswer() {
  const std::size_t end = received_.find("\r\n\r\n");
  if (end == std::string::npos) return;
  if (!absl::SimpleAtoi(received_.substr(9, 3), &http_status)) http_status = -1;
  upgraded_ = http_status == 101;
  received_.erase(0, end + 4);
}

void ViewerSocket::ReadFrames() {
  std::size_t at = 0;
  while (received_.size() - at >= 2) {
    const auto opcode = static_cast<std::uint8_t>(received_[at] & 15);
    std::uint64_t size = received_[at + 1] & 127;
    const std::size_t size_bytes = size == 127 ? 8 : size == 126 ? 2 : 0;
    if (received_.size() - at < 2 + size_bytes) break;
    if (size_bytes > 0) size = BigEndian(std::string_view(received_).substr(at + 2, size_bytes));
    if (received_.size() - at < 2 + size_bytes + size) break;
    OnFrame(opcode, std::string_view(received_).substr(at + 2 + size_bytes, size));
    at += 2 + size_bytes + size;
  }
  received_.erase(0, at);
}

void ViewerSocket::OnFrame(std::uint8_t opcode, std::string_view payload) {
  bytes += payload.size();
  if (opcode == kBinary) {
    const std::span message(reinterpret_cast<const std::uint8_t*>(payload.data()), payload.size());
    if (on_binary_) {
      on_binary_(message);
    } else {
      decoder.Take(message);
    }
  } else if (opcode == kText) {
    nlohmann::json message = nlohmann::json::parse(payload);
    const std::string type = message.at("type");
    ++texts[type];
    if (on_text_) on_text_(message);
    newest[type] = std::move(message);
  } else if (opcode == kPing) {
    SendFrame(kPong, payload);  // a viewer that is silent for long is hung up on
  } else if (opcode == kClose) {
    closed =
        payload.size() < 2 ? "" : absl::StrCat(BigEndian(payload.substr(0, 2)), " ", std::string(payload.substr(2)));
  }
}

}  // namespace tessera::gateway
