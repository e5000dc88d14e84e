#include "control_plane/cluster/names.h"

#include <algorithm>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "control_plane/control_settings.h"
#include "control_plane/one_line.h"

namespace tessera::control {
namespace {

// Lower case letters, digits and dashes.
bool IsPlain(const std::string& text) {
  return std::all_of(text.begin(), text.end(), [](char c) {
    return absl::ascii_islower(static_cast<unsigned char>(c)) || absl::ascii_isdigit(static_cast<unsigned char>(c)) ||
           c == '-';
  });
}

}  // namespace

absl::Status CheckName(const std::string& name) {
  if (!name.empty() && name.size() <= kMaxNameBytes && IsPlain(name) && name.front() != '-' && name.back() != '-') {
    return absl::OkStatus();
  }
  return absl::InvalidArgumentError(absl::StrCat("name: \"", OneLine(name, kMaxNameBytes), "\" is not 1 to ",
                                                 kMaxNameBytes, " lower case letters, digits and dashes between them"));
}

absl::Status CheckInstances(const std::string& prefix) {
  if (prefix.size() <= kMaxNameBytes && IsPlain(prefix)) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("instances: \"", OneLine(prefix, kMaxNameBytes),
                                                 "\" does not begin an instance's id, as \"inst-7\" does"));
}

}  // namespace tessera::control
