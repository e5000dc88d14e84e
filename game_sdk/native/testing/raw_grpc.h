// RawGrpc: calls of gRPC over a Unix socket by frames of HTTP/2 that are made by hand (RFC 9113, RFC 7541), for a game
// that has taken over its process and has no gRPC to link.
//
//   RawGrpc agent("/var/lib/tessera/agent/agent.sock");
//   if (agent.Say("/tessera.v1.WorkerLinkService/Attach", message) == RawGrpc::Answer::kAnswered) ...
//
// Thread rule: one thread; each read waits 5 s at most.
#pragma once

#include <sys/socket.h>
#include <sys/time.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>

class RawGrpc {
 public:
  enum class Answer {
    kNone,      // the connection ended, or nobody said anything
    kRefused,   // the call ended without a message
    kAnswered,  // a message came
  };

  explicit RawGrpc(const std::string& path) : fd_(socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    if (fd_ < 0 || path.size() >= sizeof address.sun_path) return;
    std::memcpy(address.sun_path, path.data(), path.size());
    const timeval patience{5, 0};
    setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    if (connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) return;
    Write("PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + Frame(kSettings, 0, 0, ""));
  }
  ~RawGrpc() {
    if (fd_ >= 0) close(fd_);
  }
  RawGrpc(const RawGrpc&) = delete;
  RawGrpc& operator=(const RawGrpc&) = delete;

  // Begins a call with this message, and ends it once something has come of it.
  Answer Say(const std::string& method, const std::string& message) {
    const std::uint32_t stream = next_stream_;
    next_stream_ += 2;
    Write(Frame(kHeaders, kEndHeaders, stream,
                Header(":method", "POST") + Header(":scheme", "http") + Header(":path", method) +
                    Header(":authority", "localhost") + Header("content-type", "application/grpc") +
                    Header("te", "trailers")));
    Write(Frame(kData, 0, stream,
                std::string(1, '\0') + BigEndian(static_cast<std::uint32_t>(message.size())) + message));
    const Answer answer = Await(stream);
    constexpr std::uint32_t kCancelled = 8;
    Write(Frame(kReset, 0, stream, BigEndian(kCancelled)));
    return answer;
  }

 private:
  static constexpr unsigned kData = 0, kHeaders = 1, kReset = 3, kSettings = 4, kPing = 6;  // kinds of frames
  static constexpr unsigned kAcknowledges = 1, kEndStream = 1, kEndHeaders = 4;             // their flags
  static constexpr std::size_t kFrameHead = 9;

  static std::string BigEndian(std::uint32_t value) {
    std::string bytes;
    for (int shift = 24; shift >= 0; shift -= 8) bytes.push_back(static_cast<char>((value >> shift) & 0xff));
    return bytes;
  }
  static std::string Frame(unsigned kind, unsigned flags, std::uint32_t stream, const std::string& payload) {
    std::string frame = BigEndian(static_cast<std::uint32_t>(payload.size())).substr(1);
    frame.push_back(static_cast<char>(kind));
    frame.push_back(static_cast<char>(flags));
    return frame + BigEndian(stream) + payload;
  }
  // A literal field that is not indexed; both have fewer than 127 bytes.
  static std::string Header(const std::string& name, const std::string& value) {
    std::string field(1, '\0');
    field.push_back(static_cast<char>(name.size()));
    field += name;
    field.push_back(static_cast<char>(value.size()));
    return field + value;
  }

  void Write(const std::string& bytes) const { (void)!send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL); }
  // False: the connection has ended.
  bool Read(std::size_t size, std::string& bytes) const {
    bytes.clear();
    while (bytes.size() < size) {
      char piece[4096];
      const std::size_t wanted = size - bytes.size() < sizeof piece ? size - bytes.size() : sizeof piece;
      const ssize_t got = recv(fd_, piece, wanted, 0);
      if (got <= 0) return false;
      bytes.append(piece, static_cast<std::size_t>(got));
    }
    return true;
  }
  Answer Await(std::uint32_t stream) const {
    std::string head, payload;
    while (Read(kFrameHead, head)) {
      const auto byte = [&head](std::size_t at) {
        return static_cast<std::uint32_t>(static_cast<unsigned char>(head[at]));
      };
      const std::uint32_t size = byte(0) << 16 | byte(1) << 8 | byte(2), kind = byte(3), flags = byte(4);
      const std::uint32_t of = byte(5) << 24 | byte(6) << 16 | byte(7) << 8 | byte(8);
      if (!Read(size, payload)) break;
      const bool asks = (kind == kSettings || kind == kPing) && (flags & kAcknowledges) == 0;
      if (asks) Write(Frame(kind, kAcknowledges, 0, kind == kPing ? payload : ""));
      if (of != stream) continue;
      if (kind == kData && size > 0) return Answer::kAnswered;
      if (kind == kReset || (kind == kHeaders && (flags & kEndStream) != 0)) return Answer::kRefused;
    }
    return Answer::kNone;
  }

  const int fd_;
  std::uint32_t next_stream_ = 1;
};
