#include "cli/property_argument.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_split.h"
#include "core/world/proto_math.h"
#include "local_cluster/command_error.h"

namespace tessera::cli {

v1::Property ReadProperty(const v1::Instance& instance, bool of_world, const std::string& name,
                          const std::string& value) {
  const auto& declared = of_world ? instance.world_properties() : instance.properties();
  const auto found = std::find_if(declared.begin(), declared.end(), [&](const auto& p) { return p.name() == name; });
  if (found == declared.end()) {
    std::string names;
    for (const v1::Property& property : declared) names += (names.empty() ? "" : ", ") + property.name();
    throw local::CommandError(fmt::format("KEY: the scene declares no property \"{}\"; it declares: {}", name,
                                          names.empty() ? "none" : names));
  }
  v1::Property property;
  property.set_name(name);
  const auto wrong = [&](const char* what) {
    return local::CommandError(fmt::format("VALUE: property \"{}\" is {}, not \"{}\"", name, what, value));
  };
  if (found->has_text()) {
    property.set_text(value);
  } else if (found->has_number()) {
    std::int64_t number = 0;
    if (!absl::SimpleAtoi(value, &number)) throw wrong("a whole number");
    property.set_number(number);
  } else if (found->has_real()) {
    double real = 0;
    if (!absl::SimpleAtod(value, &real)) throw wrong("a number");
    property.set_real(real);
  } else if (found->has_vector()) {
    const std::vector<std::string> parts = absl::StrSplit(value, ',');
    double xyz[3] = {};
    for (std::size_t i = 0; i < 3; ++i) {
      if (parts.size() != 3 || !absl::SimpleAtod(parts[i], &xyz[i])) throw wrong("three numbers x,y,z");
    }
    *property.mutable_vector() = ToProto(Vec3d{xyz[0], xyz[1], xyz[2]});
  } else if (found->has_body()) {
    std::uint64_t body = 0;
    if (!absl::SimpleAtoi(value, &body)) throw wrong("the id of a body");
    property.set_body(body);
  } else if (found->has_bytes()) {
    if (value.size() % 2 != 0 || !std::ranges::all_of(value, absl::ascii_isxdigit))
      throw wrong("bytes, two hexadecimal digits each");
    property.set_bytes(absl::HexStringToBytes(value));
  } else if (value == "true" || value == "false") {
    property.set_flag(value == "true");
  } else {
    throw wrong("true or false");
  }
  return property;
}

}  // namespace tessera::cli
