#include "telemetry/metrics_token.h"

#include <sodium.h>

#include <algorithm>
#include <array>
#include <cstdint>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "host/files.h"

namespace tessera::telemetry {
namespace {

constexpr std::size_t kMaxMetricsTokenFile = 4096;

// Hashes are compared, so neither the length nor the place of the first difference shows in the time.
std::array<std::uint8_t, crypto_generichash_BYTES> TokenHash(std::string_view text) {
  std::array<std::uint8_t, crypto_generichash_BYTES> hash{};
  crypto_generichash(hash.data(), hash.size(), reinterpret_cast<const std::uint8_t*>(text.data()), text.size(), nullptr,
                     0);
  return hash;
}

}  // namespace

absl::StatusOr<std::string> ReadMetricsToken(const std::string& path) {
  if (path.empty()) return std::string();
  const auto fault = [&path](absl::string_view why) {
    return absl::InvalidArgumentError(absl::StrCat("--metrics-token-file ", path, ": ", why));
  };
  auto token = host::ReadFile(path, kMaxMetricsTokenFile);
  if (!token.ok()) return fault(token.status().message());
  absl::StripAsciiWhitespace(&*token);
  if (token->size() < kMinMetricsToken || token->size() > kMaxMetricsToken) {
    return fault(
        absl::StrCat("holds ", token->size(), " characters, not ", kMinMetricsToken, " to ", kMaxMetricsToken));
  }
  const auto is_plain = [](char c) { return absl::ascii_isgraph(static_cast<unsigned char>(c)); };
  if (!std::all_of(token->begin(), token->end(), is_plain)) {
    return fault("holds a character that is not printable ASCII, or a space");
  }
  return token;
}

bool ShowsToken(std::string_view authorization, std::string_view token) {
  constexpr std::string_view kBearer = "Bearer ";
  if (!authorization.starts_with(kBearer)) return false;
  const auto shown = TokenHash(authorization.substr(kBearer.size())), right = TokenHash(token);
  return sodium_memcmp(shown.data(), right.data(), right.size()) == 0;
}

}  // namespace tessera::telemetry
