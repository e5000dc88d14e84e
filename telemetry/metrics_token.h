// The token of the scrapers' door: whoever asks a process for its metrics shows it, where the process has one.
//
//   auto token = ReadMetricsToken(flags.metrics_token_file);            // "" without a file: everybody may ask
//   auto server = MetricsServer::Start("10.0.0.7", 7702, registry, *token);
//
// Thread rule: free functions on values.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"

namespace tessera::telemetry {

// Shorter, and it is guessed; longer, and it does not fit into the headers that a server takes.
inline constexpr std::size_t kMinMetricsToken = 16, kMaxMetricsToken = 256;

// The file's content without space around it; "" for an empty path. INVALID_ARGUMENT "--metrics-token-file PATH: ...":
// it cannot be read, or holds no such token: printable ASCII without spaces.
absl::StatusOr<std::string> ReadMetricsToken(const std::string& path);

// Whether the value of an Authorization header is "Bearer TOKEN". It takes as long whichever bytes differ.
bool ShowsToken(std::string_view authorization, std::string_view token);

}  // namespace tessera::telemetry
