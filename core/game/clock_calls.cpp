#include "core/game/clock_calls.h"

#include <algorithm>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/game/settings.h"

namespace tessera::game {
namespace {

bool IsCounterName(std::string_view name) {
  const auto fits = [](char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_'; };
  return !name.empty() && name.size() <= kMaxCounterNameBytes && std::ranges::all_of(name, fits);
}

absl::StatusOr<tessera_game_value> Count(tessera_game_call& call, std::span<const tessera_game_value> arguments) {
  const std::string_view name(arguments[0].as.text, arguments[0].count);
  if (!IsCounterName(name)) {
    return absl::InvalidArgumentError(
        absl::StrCat("count: `name` must be 1 to ", kMaxCounterNameBytes, " of the characters a-z, 0-9 and _"));
  }
  std::int64_t more = 1;
  if (arguments.size() > 1 && arguments[1].type != TESSERA_GAME_NOTHING) more = arguments[1].as.whole;
  if (more < 0 || more > kMaxCounted) {
    return absl::InvalidArgumentError(absl::StrCat("count: `more` is ", more, "; it must be 0 to ", kMaxCounted));
  }
  call.transaction.Count(std::string(name), static_cast<std::uint64_t>(more));
  return tessera_game_value{};
}

}  // namespace

absl::StatusOr<tessera_game_value> CallClock(tessera_game_call& call, const Function& function,
                                             std::span<const tessera_game_value> arguments) {
  if (function.number == kWorldCount) return Count(call, arguments);
  const double rate_hz = call.transaction.world().scene().tick_rate_hz;
  return ToInterface(GameValue(static_cast<double>(call.tick.value()) / rate_hz));
}

}  // namespace tessera::game
