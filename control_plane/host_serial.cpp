#include "control_plane/host_serial.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"

namespace tessera::control {
namespace {

constexpr std::size_t kDrawnDigits = 32, kCountDigits = 4;  // MakeSerial draws 16 bytes
constexpr std::uint32_t kLastRenewal = 0xffff;

std::string_view DrawnDigits(std::string_view serial) { return serial.substr(0, kDrawnDigits); }

std::optional<std::uint32_t> CountOf(std::string_view serial) {
  if (serial.size() == kDrawnDigits) return 0;
  if (serial.size() != kDrawnDigits + kCountDigits) return std::nullopt;
  const std::string digits(serial.substr(kDrawnDigits));
  const bool are_digits =
      std::all_of(digits.begin(), digits.end(), [](unsigned char c) { return absl::ascii_isxdigit(c); });
  std::uint32_t count = 0;
  // "0000" would be a second spelling of the first.
  if (!are_digits || !absl::SimpleHexAtoi(digits, &count) || count == 0) return std::nullopt;
  return count;
}

}  // namespace

std::string NextHostSerial(std::string_view serial) {
  const auto count = CountOf(serial);
  if (!count || *count == kLastRenewal) return "";
  return absl::StrCat(std::string(DrawnDigits(serial)), absl::Hex(*count + 1, absl::kZeroPad4));
}

unsigned RenewalsOf(std::string_view serial) { return CountOf(serial).value_or(0); }

bool CountsAsSerial(std::string_view shown, std::string_view stored) {
  if (shown.empty() || stored.empty()) return false;
  if (shown == stored) return true;
  const auto shown_count = CountOf(shown), stored_count = CountOf(stored);
  return shown_count && stored_count && DrawnDigits(shown) == DrawnDigits(stored) && *shown_count > *stored_count;
}

}  // namespace tessera::control
