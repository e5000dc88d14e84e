// Values with which the host calls a game: who sent a message, and named values as a record keeps them.
//
// Thread rule: plain values.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/game/arguments.h"
#include "core/game/mail.h"
#include "core/game/settings.h"
#include "core/game/value.h"

namespace tessera::game {

// Gives the sender of a message as on_message is told of it.
inline tessera_game_value SenderValue(BodyId speaker) {
  static const std::string kBackend = "backend";
  if (speaker == kBackendSender) return TextResult(kBackend);
  return speaker == BodyId() ? tessera_game_value{} : BodyResult(speaker);
}

// Fields as one value, which lives as long as they do.
inline tessera_game_value FieldsValue(std::span<const tessera_game_field> fields) {
  tessera_game_value value{};
  value.type = TESSERA_GAME_FIELDS;
  value.count = static_cast<std::uint32_t>(fields.size());
  value.as.fields = fields.data();
  return value;
}

// Named values as a record keeps them, for an argument.
class KeptFields {
 public:
  explicit KeptFields(std::span<const std::uint8_t> bytes) : kept_(DecodeFields(bytes, kMaxMessageBytes)) {
    if (!kept_.ok()) return;
    fields_.reserve(kept_->size());
    for (const auto& [name, value] : *kept_) fields_.push_back({name.data(), name.size(), ToInterface(value)});
  }
  tessera_game_value value() const { return FieldsValue(fields_); }

 private:
  const absl::StatusOr<GameFields> kept_;
  std::vector<tessera_game_field> fields_;
};

}  // namespace tessera::game
