#include "game_sdk/testing/kept_value.h"

namespace tessera::game {

KeptValue::KeptValue(const tessera_game_value& value) : value_(value) {
  switch (value.type) {
    case TESSERA_GAME_TEXT:
      text_.assign(value.as.text, value.count);
      break;
    case TESSERA_GAME_LIST:
      for (std::uint32_t i = 0; i < value.count; ++i) items_.emplace_back(value.as.list[i]);
      break;
    case TESSERA_GAME_FIELDS:
      for (std::uint32_t i = 0; i < value.count; ++i) {
        const tessera_game_field& field = value.as.fields[i];
        names_.emplace_back(field.name, field.name_bytes);
        items_.emplace_back(field.value);
      }
      break;
    default:
      break;
  }
}

tessera_game_value KeptValue::Expose() const {
  tessera_game_value value = value_;
  switch (value.type) {
    case TESSERA_GAME_TEXT:
      value.as.text = text_.c_str();
      break;
    case TESSERA_GAME_LIST:
      list_.clear();
      for (const KeptValue& item : items_) list_.push_back(item.Expose());
      value.as.list = list_.data();
      break;
    case TESSERA_GAME_FIELDS:
      fields_.clear();
      for (std::size_t i = 0; i < items_.size(); ++i) {
        fields_.push_back({names_[i].c_str(), names_[i].size(), items_[i].Expose()});
      }
      value.as.fields = fields_.data();
      break;
    default:
      break;
  }
  return value;
}

std::vector<tessera_game_value> KeptArguments::Expose() const {
  std::vector<tessera_game_value> values;
  values.reserve(items_.size());
  for (const KeptValue& item : items_) values.push_back(item.Expose());
  return values;
}

}  // namespace tessera::game
