#include "core/game/game_file.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "core/world/sha256.h"
#include "core/world/utf8.h"

namespace tessera::game {
namespace {

bool IsControl(char c) {
  const auto byte = static_cast<unsigned char>(c);
  return byte < 0x20 || byte == 0x7f;
}

}  // namespace

absl::Status CheckGameFile(const GameFile& file) {
  if (file.name.empty() || file.name.size() > kMaxGameNameBytes || std::ranges::any_of(file.name, IsControl) ||
      !IsUtf8(file.name)) {
    return absl::InvalidArgumentError(
        absl::StrCat("name: must be 1 to ", kMaxGameNameBytes, " bytes of UTF-8 without control characters"));
  }
  if (file.bytes.empty()) return absl::InvalidArgumentError("content: is empty");
  if (file.bytes.size() > kMaxGameFileBytes) {
    return absl::InvalidArgumentError(
        absl::StrCat("content: has ", file.bytes.size(), " bytes, more than ", kMaxGameFileBytes));
  }
  return absl::OkStatus();
}

std::string GameHash(std::string_view bytes) { return Sha256Hex(bytes); }

// The first 64 bits of a hash: ids of instances differ in one digit, and so little must not make two games alike.
std::uint64_t GameSeed(std::string_view instance_id) {
  std::uint64_t seed = 0;
  for (const char digit : Sha256Hex(instance_id).substr(0, 16)) {
    const int value = digit <= '9' ? digit - '0' : digit - 'a' + 10;
    seed = seed << 4 | static_cast<std::uint64_t>(value);
  }
  return seed;
}

}  // namespace tessera::game
