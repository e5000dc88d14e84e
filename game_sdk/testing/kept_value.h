// KeptValue: a value of the interface that owns all that it points to, of any type and depth.
//
// Thread rule: a plain value.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "game_sdk/include/tessera/game.h"

namespace tessera::game {

class KeptValue {
 public:
  KeptValue() = default;
  explicit KeptValue(const tessera_game_value& value);

  // Valid until this is changed, moved or asked again.
  tessera_game_value Expose() const;

 private:
  tessera_game_value value_{};  // without its pointer
  std::string text_;
  std::vector<std::string> names_;  // names of fields
  std::vector<KeptValue> items_;    // items of a list, or values of fields
  mutable std::vector<tessera_game_value> list_;
  mutable std::vector<tessera_game_field> fields_;
};

// Arguments of a call.
class KeptArguments {
 public:
  KeptArguments(const tessera_game_value* values, std::size_t count) : items_(values, values + count) {}
  // Valid as above.
  std::vector<tessera_game_value> Expose() const;

 private:
  std::vector<KeptValue> items_;
};

}  // namespace tessera::game
