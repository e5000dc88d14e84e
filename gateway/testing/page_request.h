// PageRequest: one HTTP request with headers of the caller's choice, and all of its answer, so that tests see what goes
// over the wire and not what a client makes of it.
//
//   const PageAnswer page = RequestPage("127.0.0.1:7710", "/assets/page.js", {"Accept-Encoding: gzip"});
//   Gunzip(page.body) == ReadFile("web/dist/assets/page.js")
//
// Thread rule: any thread; blocks until the other end closes the connection.
#pragma once

#include <map>
#include <string>
#include <vector>

namespace tessera::gateway {

struct PageAnswer {
  int status = 0;                              // 0: no answer
  std::map<std::string, std::string> headers;  // names in lower case
  std::string body;                            // as it came, compressed or not
};

PageAnswer RequestPage(const std::string& address, const std::string& path,
                       const std::vector<std::string>& headers = {}, const std::string& method = "GET");

// Empty where it is not gzip.
std::string Gunzip(const std::string& packed);

}  // namespace tessera::gateway
