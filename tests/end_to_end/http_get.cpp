#include "tests/end_to_end/http_get.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <cctype>
#include <cstdio>
#include <cstdlib>

namespace tessera::end_to_end {
namespace {

constexpr timeval kPatience{.tv_sec = 10,
                            .tv_usec = 0};  // for one answer; a test that hangs tells less than one that fails

std::string ReadAll(int fd) {
  std::string text;
  char buffer[16384];
  for (ssize_t n = 0; (n = recv(fd, buffer, sizeof(buffer), 0)) > 0;) text.append(buffer, static_cast<std::size_t>(n));
  return text;
}

}  // namespace

std::optional<HttpAnswer> HttpGet(const std::string& address, const std::string& path_and_query) {
  const auto colon = address.rfind(':');
  sockaddr_in peer{};
  peer.sin_family = AF_INET;
  if (colon == std::string::npos || inet_pton(AF_INET, address.substr(0, colon).c_str(), &peer.sin_addr) != 1)
    return {};
  peer.sin_port = htons(static_cast<std::uint16_t>(std::strtoul(address.c_str() + colon + 1, nullptr, 10)));

  const int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return {};
  setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &kPatience, sizeof(kPatience));
  std::string reply;
  if (connect(fd, reinterpret_cast<const sockaddr*>(&peer), sizeof(peer)) == 0) {
    // HTTP/1.0: the answer is not chunked and ends with the connection.
    const std::string request = "GET " + path_and_query + " HTTP/1.0\r\nHost: " + address + "\r\n\r\n";
    if (send(fd, request.data(), request.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(request.size()))
      reply = ReadAll(fd);
  }
  close(fd);

  HttpAnswer answer;
  const auto body = reply.find("\r\n\r\n");
  if (body == std::string::npos || std::sscanf(reply.c_str(), "HTTP/%*d.%*d %d", &answer.status) != 1) return {};
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

}  // namespace tessera::end_to_end
