#include "telemetry/http_get.h"

#include <civetweb.h>

#include <array>
#include <memory>

#include "absl/strings/str_cat.h"
#include "host/socket_address.h"

namespace tessera::telemetry {
namespace {

using Connection = std::unique_ptr<mg_connection, decltype(&mg_close_connection)>;

constexpr int kPatience_ms = 10'000;  // a caller that hangs says less than one that fails

std::string Authorization(const std::string& bearer_token) {
  return bearer_token.empty() ? "" : absl::StrCat("Authorization: Bearer ", bearer_token, "\r\n");
}

absl::StatusOr<HttpAnswer> Ask(const char* method, const char* headers, const std::string& address,
                               const std::string& path_and_query) {
  const auto fail = [&](const std::string& why) {
    return absl::UnavailableError(absl::StrCat("http://", address, path_and_query, ": ", why));
  };
  const auto server = host::ParseSocketAddress(address, host::PortRule::kFrom1);
  if (!server.ok()) return fail(std::string(server.status().message()));
  [[maybe_unused]] static const unsigned features = mg_init_library(0);
  std::array<char, 256> error{};
  const Connection connection(mg_connect_client(server->host.c_str(), server->port, 0, error.data(), error.size()),
                              mg_close_connection);
  // HTTP/1.0: the answer ends with the connection.
  if (connection == nullptr ||
      mg_printf(connection.get(), "%s %s HTTP/1.0\r\nHost: %s\r\n%s\r\n", method, path_and_query.c_str(),
                address.c_str(), headers) <= 0 ||
      mg_get_response(connection.get(), error.data(), error.size(), kPatience_ms) < 0) {
    return fail(error.data());
  }
  HttpAnswer answer;
  answer.status = mg_get_response_info(connection.get())->status_code;
  std::array<char, 16384> piece;
  for (int got = 0; (got = mg_read(connection.get(), piece.data(), piece.size())) > 0;) {
    answer.body.append(piece.data(), static_cast<std::size_t>(got));
  }
  return answer;
}

}  // namespace

absl::StatusOr<HttpAnswer> HttpGet(const std::string& address, const std::string& path_and_query,
                                   const std::string& bearer_token) {
  return Ask("GET", Authorization(bearer_token).c_str(), address, path_and_query);
}

absl::StatusOr<HttpAnswer> HttpPost(const std::string& address, const std::string& path,
                                    const std::string& bearer_token) {
  const std::string headers = absl::StrCat("Content-Length: 0\r\n", Authorization(bearer_token));
  return Ask("POST", headers.c_str(), address, path);
}

std::string UrlEncode(const std::string& text) {
  std::string encoded(3 * text.size() + 1, '\0');
  encoded.resize(static_cast<std::size_t>(mg_url_encode(text.c_str(), encoded.data(), encoded.size())));
  return encoded;
}

}  // namespace tessera::telemetry
