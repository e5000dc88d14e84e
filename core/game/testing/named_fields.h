// NamedFields: named values as an argument of a game's call, for tests. They live as long as this does.
#pragma once

#include <cstring>
#include <initializer_list>
#include <utility>
#include <vector>

#include "core/game/host_values.h"

namespace tessera::game {

class NamedFields {
 public:
  NamedFields(std::initializer_list<std::pair<const char*, tessera_game_value>> values) {
    for (const auto& [name, value] : values) fields_.push_back({name, std::strlen(name), value});
  }
  tessera_game_value value() const { return FieldsValue(fields_); }

 private:
  std::vector<tessera_game_field> fields_;
};

}  // namespace tessera::game
