#include "core/game/arguments.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"

namespace tessera::game {
namespace {

bool IsFiniteArgument(const tessera_game_value& value) {
  const auto finite = [&](std::span<const double> parts) {
    return std::ranges::all_of(parts, [](double part) { return std::isfinite(part); });
  };
  switch (value.type) {
    case TESSERA_GAME_REAL:
      return std::isfinite(value.as.real);
    case TESSERA_GAME_VECTOR:
      return finite(value.as.vector);
    case TESSERA_GAME_ROTATION:
      return finite(value.as.rotation);
    default:
      return true;
  }
}

std::string NamesOfTypes(Types types) {
  std::vector<absl::string_view> names;
  for (unsigned type = 0; type <= TESSERA_GAME_FIELDS; ++type) {
    if ((types >> type & 1) != 0) names.push_back(ViewOf(TypeName(static_cast<tessera_game_type>(type))));
  }
  return absl::StrJoin(names, " or ");
}

absl::Status CheckArgument(const Function& function, const Parameter& parameter, const tessera_game_value& value) {
  const bool known = value.type <= TESSERA_GAME_FIELDS;
  const Types given = known ? Types{1} << value.type : Types{0};
  const bool widened = given == kWholeType && (parameter.types & kRealType) != 0;
  if ((given & parameter.types) == 0 && !widened) {
    return ArgumentFault(
        function.name, absl::StrCat("`", ViewOf(parameter.name), "` must be ", NamesOfTypes(parameter.types), ", got ",
                                    ViewOf(TypeName(static_cast<tessera_game_type>(value.type)))));
  }
  if (!IsFiniteArgument(value))
    return ArgumentFault(function.name, absl::StrCat("`", ViewOf(parameter.name), "` is not finite"));
  return absl::OkStatus();
}

}  // namespace

absl::Status ArgumentFault(std::string_view function, std::string_view what) {
  return absl::InvalidArgumentError(absl::StrCat(ViewOf(function), ": ", ViewOf(what)));
}

absl::Status CheckArguments(const Function& function, CallArguments arguments) {
  if (function.parameters.empty() && arguments.empty()) return absl::OkStatus();
  const std::size_t most = function.parameters.size();
  const auto least = static_cast<std::size_t>(
      std::ranges::count_if(function.parameters, [](const Parameter& parameter) { return !parameter.optional; }));
  if (arguments.size() > most) {
    return ArgumentFault(function.name, absl::StrCat("takes ", most, " arguments, got ", arguments.size()));
  }
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    const Parameter& parameter = function.parameters[i];
    if (parameter.optional && arguments[i].type == TESSERA_GAME_NOTHING) continue;
    if (absl::Status status = CheckArgument(function, parameter, arguments[i]); !status.ok()) return status;
  }
  if (arguments.size() < least) {
    return ArgumentFault(function.name,
                         absl::StrCat("`", ViewOf(function.parameters[arguments.size()].name), "` is missing"));
  }
  return absl::OkStatus();
}

}  // namespace tessera::game
