// HttpGet, HttpPost: one request to a program of ours, by CivetWeb's client.
//
// Thread rule: any thread; blocks until the answer is complete, at most 10 s for each piece of it.
#pragma once

#include <string>

#include "absl/status/statusor.h"

namespace tessera::telemetry {

struct HttpAnswer {
  int status = 0;
  std::string body;
};

// `address` is "127.0.0.1:9090", `path_and_query` starts with '/'. UNAVAILABLE, which names the page, where nobody
// listens or the answer is not HTTP. `bearer_token` proves who asks; empty: nobody.
absl::StatusOr<HttpAnswer> HttpGet(const std::string& address, const std::string& path_and_query,
                                   const std::string& bearer_token = "");

// Without a body.
absl::StatusOr<HttpAnswer> HttpPost(const std::string& address, const std::string& path,
                                    const std::string& bearer_token = "");

// `text` as a value in a query.
std::string UrlEncode(const std::string& text);

}  // namespace tessera::telemetry
