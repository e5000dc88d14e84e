#include "telemetry/logging.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <memory>
#include <utility>

#include "absl/strings/str_cat.h"
#include "spdlog/sinks/stdout_sinks.h"
#include "spdlog/spdlog.h"

namespace tessera::telemetry {
namespace {

constexpr std::array<std::pair<std::string_view, spdlog::level::level_enum>, 6> kLevels = {{
    {"trace", spdlog::level::trace},
    {"debug", spdlog::level::debug},
    {"info", spdlog::level::info},
    {"warning", spdlog::level::warn},
    {"error", spdlog::level::err},
    {"off", spdlog::level::off},
}};

}  // namespace

absl::Status InitLogging(const std::string& component, std::string_view flag) {
  std::string level = "info";  // Debian builds Abseil with a string_view of its own, so StrCat takes no std one
  std::string source = "default";
  const char* environment = std::getenv(kLogEnvironment);
  if (!flag.empty()) {
    level = std::string(flag);
    source = "--log-level";
  } else if (environment != nullptr && *environment != '\0') {
    level = environment;
    source = kLogEnvironment;
  }
  const auto* const found =
      std::find_if(kLevels.begin(), kLevels.end(), [&](const auto& l) { return l.first == level; });
  if (found == kLevels.end()) {
    return absl::InvalidArgumentError(absl::StrCat(source, ": unknown log level ", LogValue(level),
                                                   "; use trace, debug, info, warning, error or off"));
  }
  auto logger = std::make_shared<spdlog::logger>(component, std::make_shared<spdlog::sinks::stderr_sink_mt>());
  logger->set_pattern("%Y-%m-%dT%H:%M:%S.%eZ %l %n: %v", spdlog::pattern_time_type::utc);
  logger->set_level(found->second);
  logger->flush_on(spdlog::level::trace);  // a line about a crash must not die in a buffer
  spdlog::set_default_logger(std::move(logger));
  return absl::OkStatus();
}

}  // namespace tessera::telemetry
