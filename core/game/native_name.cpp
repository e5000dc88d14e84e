#include "core/game/native_name.h"

#include <algorithm>

#include "absl/strings/str_cat.h"

namespace tessera::game {
namespace {

constexpr std::size_t kMaxModuleName = 63, kModuleHashDigits = 64, kShownDigits = 8;

}  // namespace

absl::Status CheckModuleName(std::string_view name) {
  const bool sound = !name.empty() && name.size() <= kMaxModuleName && std::ranges::all_of(name, [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
  });
  if (sound) return absl::OkStatus();
  return absl::InvalidArgumentError("game module: its name must be 1 to 63 letters, digits, '_' and '-'");
}

bool IsModuleHash(std::string_view text) {
  return text.size() == kModuleHashDigits &&
         std::ranges::all_of(text, [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); });
}

bool IsNativeGame(std::string_view text) { return text.starts_with(kNativePrefix); }

absl::StatusOr<NativeGameName> ParseNativeGame(std::string_view text) {
  if (!IsNativeGame(text)) return absl::InvalidArgumentError("game module: must be native:NAME or native:NAME@SHA256");
  text.remove_prefix(kNativePrefix.size());
  const std::size_t mark = text.find('@');
  const std::string_view name = text.substr(0, mark);
  if (absl::Status status = CheckModuleName(name); !status.ok()) return status;
  if (mark == std::string_view::npos) return NativeGameName{std::string(name), ""};
  const std::string_view hash = text.substr(mark + 1);
  if (IsModuleHash(hash)) return NativeGameName{std::string(name), std::string(hash)};
  return absl::InvalidArgumentError(absl::StrCat("game module ", absl::string_view(name.data(), name.size()),
                                                 ": after '@' must come the 64 hexadecimal digits of its SHA-256"));
}

std::string NativeGameText(std::string_view name, std::string_view hash) {
  std::string text(kNativePrefix);
  text.append(name);
  if (!hash.empty()) text.append("@").append(hash.substr(0, kShownDigits));
  return text;
}

std::string_view DeathInModule(std::string_view line) {
  return line.starts_with(kDiedInModule) ? line.substr(kDiedInModule.size()) : std::string_view();
}

}  // namespace tessera::game
