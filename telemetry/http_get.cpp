#include "telemetry/http_get.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <array>
#include <cctype>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "absl/strings/str_cat.h"

namespace tessera::telemetry {
namespace {

constexpr timeval kPatience{.tv_sec = 10, .tv_usec = 0};  // a caller that hangs tells less than one that fails

// HTTP/1.0: the answer is not chunked and ends with the connection.
std::string Exchange(int fd, const sockaddr_in& peer, const std::string& request) {
  std::string reply;
  setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &kPatience, sizeof(kPatience));
  if (connect(fd, reinterpret_cast<const sockaddr*>(&peer), sizeof(peer)) != 0) return reply;
  if (send(fd, request.data(), request.size(), MSG_NOSIGNAL) != static_cast<ssize_t>(request.size())) return reply;
  std::array<char, 16384> buffer;
  for (ssize_t n = 0; (n = recv(fd, buffer.data(), buffer.size(), 0)) > 0;)
    reply.append(buffer.data(), static_cast<std::size_t>(n));
  return reply;
}

}  // namespace

absl::StatusOr<HttpAnswer> HttpGet(const std::string& address, const std::string& path_and_query) {
  const auto fail = [&](const std::string& why) {
    return absl::UnavailableError(absl::StrCat("http://", address, path_and_query, ": ", why));
  };
  const auto colon = address.rfind(':');
  sockaddr_in peer{};
  peer.sin_family = AF_INET;
  if (colon == std::string::npos || inet_pton(AF_INET, address.substr(0, colon).c_str(), &peer.sin_addr) != 1)
    return fail("not an IPv4 address and port");
  peer.sin_port = htons(static_cast<std::uint16_t>(std::strtoul(address.c_str() + colon + 1, nullptr, 10)));

  const int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return fail(std::strerror(errno));
  errno = 0;
  const std::string reply =
      Exchange(fd, peer, absl::StrCat("GET ", path_and_query, " HTTP/1.0\r\nHost: ", address, "\r\n\r\n"));
  const int error = errno;
  close(fd);

  HttpAnswer answer;
  const auto body = reply.find("\r\n\r\n");
  if (body == std::string::npos || std::sscanf(reply.c_str(), "HTTP/%*d.%*d %d", &answer.status) != 1)
    return fail(error != 0 ? std::strerror(error) : "the answer is not HTTP");
  answer.body = reply.substr(body + 4);
  return answer;
}

std::string UrlEncode(const std::string& text) {
  std::string encoded;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (std::isalnum(byte) != 0) {
      encoded += c;
    } else {
      constexpr char kHex[] = "0123456789ABCDEF";
      encoded += {'%', kHex[byte >> 4], kHex[byte & 15]};
    }
  }
  return encoded;
}

}  // namespace tessera::telemetry
