#include "gateway/web_request.h"

#include <arpa/inet.h>

#include <algorithm>
#include <array>

namespace tessera::gateway {
namespace {

// The name in "name:port"; "[::1]" in "[::1]:80".
std::string NameIn(const std::string& host) {
  const std::size_t end = host.empty() || host[0] != '[' ? host.rfind(':') : host.find(']') + 1;
  return host.substr(0, end);
}

bool IsAddress(const std::string& name) {
  if (name == "localhost") return true;
  std::array<unsigned char, sizeof(in6_addr)> address{};
  if (inet_pton(AF_INET, name.c_str(), address.data()) == 1) return true;
  return name.size() > 2 && name.front() == '[' && name.back() == ']' &&
         inet_pton(AF_INET6, name.substr(1, name.size() - 2).c_str(), address.data()) == 1;
}

std::string WithoutScheme(const std::string& origin) {
  const std::size_t at = origin.find("://");
  return at == std::string::npos ? origin : origin.substr(at + 3);
}

}  // namespace

bool MayConnect(const std::string& host, const std::string& origin, const std::vector<std::string>& allow_origins) {
  const auto allowed = [&](const std::string& name) {
    return std::any_of(allow_origins.begin(), allow_origins.end(),
                       [&](const std::string& allow) { return allow == name || WithoutScheme(allow) == name; });
  };
  if (!IsAddress(NameIn(host)) && !allowed(host)) return false;
  return origin.empty() || WithoutScheme(origin) == host || allowed(origin);
}

bool IsName(absl::string_view name, std::size_t most) {
  return !name.empty() && name.size() <= most && std::all_of(name.begin(), name.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_' ||
           c == '.';
  });
}

std::string HeaderOf(lws* wsi, lws_token_indexes header) {
  std::array<char, 512> text{};
  const int bytes = lws_hdr_copy(wsi, text.data(), text.size(), header);
  return bytes > 0 ? std::string(text.data(), static_cast<std::size_t>(bytes)) : "";
}

bool AddHeader(lws* wsi, lws_token_indexes header, const std::string& value, unsigned char** at, unsigned char* end) {
  return lws_add_http_header_by_token(wsi, header, reinterpret_cast<const unsigned char*>(value.data()),
                                      static_cast<int>(value.size()), at, end) == 0;
}

const lws_protocol_vhost_options* CommonHeaders() {
  static const lws_protocol_vhost_options referrer{nullptr, nullptr, "referrer-policy:", "no-referrer"};
  static const lws_protocol_vhost_options sniff{&referrer, nullptr, "x-content-type-options:", "nosniff"};
  static const lws_protocol_vhost_options policy{
      &sniff, nullptr, "content-security-policy:",
      "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; worker-src 'self' blob:; "
      "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"};
  return &policy;
}

}  // namespace tessera::gateway
