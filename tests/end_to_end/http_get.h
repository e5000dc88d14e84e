// GET over loopback, for tests: enough HTTP to ask our own programs and Prometheus.
#pragma once

#include <optional>
#include <string>

namespace tessera::end_to_end {

struct HttpAnswer {
  int status = 0;
  std::string body;
};

// `address` is "127.0.0.1:9090". Nothing if nobody listens or what comes back is not HTTP.
std::optional<HttpAnswer> HttpGet(const std::string& address, const std::string& path_and_query);

// `text` as a value in a query.
std::string UrlEncode(const std::string& text);

}  // namespace tessera::end_to_end
