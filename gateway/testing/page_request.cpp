#include "gateway/testing/page_request.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>
#include <zlib.h>

#include <cstdint>

#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"

namespace tessera::gateway {
namespace {

constexpr timeval kReadPatience{.tv_sec = 30, .tv_usec = 0};

std::string Exchange(const std::string& address, const std::string& request) {
  const std::size_t colon = address.rfind(':');
  std::uint32_t port = 0;
  sockaddr_in to{};
  to.sin_family = AF_INET;
  if (!absl::SimpleAtoi(address.substr(colon + 1), &port) ||
      inet_pton(AF_INET, address.substr(0, colon).c_str(), &to.sin_addr) != 1) {
    return "";
  }
  to.sin_port = htons(static_cast<std::uint16_t>(port));
  const int socket = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  setsockopt(socket, SOL_SOCKET, SO_RCVTIMEO, &kReadPatience, sizeof kReadPatience);
  std::string answer;
  if (connect(socket, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0 &&
      send(socket, request.data(), request.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(request.size())) {
    std::string piece(std::size_t{1} << 16, '\0');
    for (ssize_t got = 0; (got = recv(socket, piece.data(), piece.size(), 0)) > 0;) {
      answer.append(piece, 0, static_cast<std::size_t>(got));
    }
  }
  close(socket);
  return answer;
}

}  // namespace

PageAnswer RequestPage(const std::string& address, const std::string& path, const std::vector<std::string>& headers,
                       const std::string& method) {
  std::string request = absl::StrCat(method, " ", path, " HTTP/1.1\r\nHost: ", address, "\r\nConnection: close\r\n");
  for (const std::string& header : headers) absl::StrAppend(&request, header, "\r\n");
  const std::string answer = Exchange(address, request + "\r\n");
  PageAnswer page;
  const std::size_t end = answer.find("\r\n\r\n");
  if (end == std::string::npos || !absl::SimpleAtoi(answer.substr(9, 3), &page.status)) return page;
  const std::vector<std::string> lines = absl::StrSplit(answer.substr(0, end), "\r\n");
  for (const std::string& line : lines) {
    const std::size_t colon = line.find(':');
    if (colon == std::string::npos) continue;
    page.headers[absl::AsciiStrToLower(line.substr(0, colon))] =
        std::string(absl::StripAsciiWhitespace(line.substr(colon + 1)));
  }
  page.body = answer.substr(end + 4);
  return page;
}

std::string Gunzip(const std::string& packed) {
  z_stream stream{};
  if (inflateInit2(&stream, 15 + 16) != Z_OK) return "";
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
  stream.avail_in = static_cast<uInt>(packed.size());
  std::string plain, piece(std::size_t{1} << 16, '\0');
  int result = Z_OK;
  while (result == Z_OK) {
    stream.next_out = reinterpret_cast<Bytef*>(piece.data());
    stream.avail_out = static_cast<uInt>(piece.size());
    result = inflate(&stream, Z_NO_FLUSH);
    plain.append(piece, 0, piece.size() - stream.avail_out);
  }
  inflateEnd(&stream);
  return result == Z_STREAM_END ? plain : "";
}

}  // namespace tessera::gateway
