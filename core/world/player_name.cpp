#include "core/world/player_name.h"

#include "absl/strings/str_cat.h"
#include "core/world/utf8.h"

namespace tessera {

bool HasNoControls(std::string_view utf8) {
  for (std::size_t i = 0; i < utf8.size(); ++i) {
    const auto byte = static_cast<unsigned char>(utf8[i]);
    if (byte < 0x20 || byte == 0x7f) return false;
    // U+0080 to U+009F are C2 80 to C2 9F.
    if (byte == 0xc2 && i + 1 < utf8.size() && static_cast<unsigned char>(utf8[i + 1]) < 0xa0) return false;
  }
  return true;
}

absl::Status CheckPlayerName(std::string_view name) {
  if (name.size() > kMaxPlayerNameBytes) {
    return absl::InvalidArgumentError(
        absl::StrCat("player_name: ", name.size(), " bytes are more than ", kMaxPlayerNameBytes));
  }
  if (!IsUtf8(name)) return absl::InvalidArgumentError("player_name: is not UTF-8");
  if (!HasNoControls(name)) return absl::InvalidArgumentError("player_name: has a control character");
  return absl::OkStatus();
}

}  // namespace tessera
