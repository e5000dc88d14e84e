#include "client_sdk/correction.h"

#include <cmath>
#include <cstdio>

#include "absl/strings/str_cat.h"

namespace tessera::client {

std::string Describe(const Correction& correction) {
  const auto cause = [&]() -> std::string {
    const std::uint64_t inputs = static_cast<std::uint64_t>(std::abs(correction.late));
    switch (correction.cause) {
      case Correction::Cause::kOwner:
        return absl::StrCat("region ", correction.from.value(), " moved it before");
      case Correction::Cause::kInputs:
        return absl::StrCat(inputs, inputs == 1 ? " input" : " inputs", " acted ",
                            correction.late > 0 ? "late" : "early");
      case Correction::Cause::kMeeting:
        return absl::StrCat("it met body ", correction.met.value());
      case Correction::Cause::kUnknown:
        break;
    }
    return "nothing known here explains it";
  };
  char metres[32];
  std::snprintf(metres, sizeof(metres), "%.2f m: ", correction.off_m);
  return metres + cause();
}

}  // namespace tessera::client
