#include "control_plane/s3/s3_address.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"

namespace tessera::control {
namespace {

constexpr char kScheme[] = "s3://";

absl::Status WrongAddress(const std::string& text, const char* why) {
  return absl::InvalidArgumentError(absl::StrCat("checkpoints: ", text, ": ", why));
}

bool IsPrefixPart(const std::string& part) {
  return !part.empty() && part != "." && part != ".." && std::all_of(part.begin(), part.end(), [](char c) {
    return absl::ascii_isalnum(c) || c == '.' || c == '_' || c == '-';
  });
}

// Plain HTTP shows everybody on the way what is kept.
bool IsLocal(const std::string& host) {
  return host.starts_with("127.") || host == "localhost" || host.starts_with("localhost:") || host.starts_with("[::1]");
}

}  // namespace

bool IsS3Address(const std::string& text) { return text.starts_with(kScheme); }

absl::StatusOr<S3Address> ParseS3Address(const std::string& text) {
  if (!IsS3Address(text)) return WrongAddress(text, "does not begin with s3://");
  const std::pair<std::string, std::string> parts =
      absl::StrSplit(text.substr(sizeof(kScheme) - 1), absl::MaxSplits('/', 1));
  S3Address address{.bucket = parts.first, .prefix = parts.second};
  const bool named =
      address.bucket.size() >= 3 && address.bucket.size() <= 63 && address.bucket.find("..") == std::string::npos &&
      std::all_of(address.bucket.begin(), address.bucket.end(),
                  [](char c) { return absl::ascii_islower(c) || absl::ascii_isdigit(c) || c == '.' || c == '-'; });
  if (!named) return WrongAddress(text, "a bucket has 3 to 63 lower-case letters, digits, dots and hyphens");
  while (address.prefix.ends_with('/')) address.prefix.pop_back();
  if (address.prefix.empty()) return address;
  const std::vector<std::string> folders = absl::StrSplit(address.prefix, '/');
  if (address.prefix.size() > 512 || !std::all_of(folders.begin(), folders.end(), IsPrefixPart)) {
    return WrongAddress(text,
                        "a prefix has at most 512 letters, digits, dots, hyphens, underscores and single slashes");
  }
  address.prefix += '/';
  return address;
}

absl::StatusOr<S3Settings> MakeS3Settings(const std::string& address, const std::string& endpoint,
                                          const std::string& region, const Environment& environment) {
  auto parsed = ParseS3Address(address);
  if (!parsed.ok()) return parsed.status();
  S3Settings settings{.address = *std::move(parsed),
                      .name = address,
                      .endpoint = std::string(absl::StripSuffix(endpoint, "/")),
                      .region = region,
                      .access_key = environment("AWS_ACCESS_KEY_ID").value_or(""),
                      .secret_key = environment("AWS_SECRET_ACCESS_KEY").value_or(""),
                      .session_token = environment("AWS_SESSION_TOKEN").value_or("")};
  for (const auto& [variable, value] : {std::pair("AWS_ACCESS_KEY_ID", &settings.access_key),
                                        std::pair("AWS_SECRET_ACCESS_KEY", &settings.secret_key)}) {
    if (!value->empty()) continue;
    return absl::InvalidArgumentError(
        absl::StrCat("checkpoints: ", address, " needs ", variable,
                     " in the environment; with systemd in /etc/default/tessera-control"));
  }
  if (settings.region.empty()) settings.region = environment("AWS_REGION").value_or("us-east-1");
  if (!IsPrefixPart(settings.region)) {
    return absl::InvalidArgumentError(absl::StrCat("s3_region: ", settings.region, " names no region"));
  }
  if (settings.endpoint.empty()) settings.endpoint = absl::StrCat("https://s3.", settings.region, ".amazonaws.com");
  const bool plain = settings.endpoint.starts_with("http://"), encrypted = settings.endpoint.starts_with("https://");
  const std::string host = settings.endpoint.substr(plain ? 7 : encrypted ? 8 : 0);
  if ((!plain && !encrypted) || host.empty() || host.find_first_of("/?#@ ") != std::string::npos) {
    return absl::InvalidArgumentError(
        absl::StrCat("s3_endpoint: ", settings.endpoint, " is not https://HOST or https://HOST:PORT"));
  }
  if (plain && !IsLocal(host)) {
    return absl::InvalidArgumentError(
        absl::StrCat("s3_endpoint: ", settings.endpoint, " is not encrypted; http is for this machine alone"));
  }
  return settings;
}

}  // namespace tessera::control
