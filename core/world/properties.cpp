#include "core/world/properties.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "core/world/bytes.h"

namespace tessera {
namespace {

constexpr const char* kTypeNames[] = {"true or false", "a whole number", "a number", "a text"};

std::optional<std::size_t> PlaceIn(std::span<const PropertyDef> defs, std::string_view name) {
  const auto at = std::find_if(defs.begin(), defs.end(), [&](const PropertyDef& def) { return def.name == name; });
  if (at == defs.end()) return std::nullopt;
  return static_cast<std::size_t>(at - defs.begin());
}

absl::Status Check(const PropertyDef& def, const PropertyValue& value) {
  const auto wrong = [&](const std::string& what) {
    return absl::InvalidArgumentError(absl::StrCat("property \"", def.name, "\" ", what));
  };
  if (value.index() != def.initial.index()) return wrong(absl::StrCat("is ", kTypeNames[def.initial.index()]));
  if (const double* number = std::get_if<double>(&value); number != nullptr) {
    if (!std::isfinite(*number)) return wrong("is not finite");
    if (std::abs(*number) > kMaxPropertyReal) return wrong(absl::StrCat("is beyond ", kMaxPropertyReal));
  }
  if (const std::string* text = std::get_if<std::string>(&value); text != nullptr && text->size() > kMaxPropertyText) {
    return wrong(absl::StrCat("is longer than ", kMaxPropertyText, " bytes"));
  }
  return absl::OkStatus();
}

void WriteValue(ByteWriter& out, const PropertyValue& value) {
  if (const bool* flag = std::get_if<bool>(&value)) return out.U8(*flag ? 1 : 0);
  if (const std::int64_t* number = std::get_if<std::int64_t>(&value)) {
    return out.Varint((static_cast<std::uint64_t>(*number) << 1) ^ static_cast<std::uint64_t>(*number >> 63));
  }
  if (const double* number = std::get_if<double>(&value)) return out.F64(*number);
  const std::string& text = std::get<std::string>(value);
  out.U8(static_cast<std::uint8_t>(text.size()));
  out.Text(text);
}

PropertyValue ReadValue(ByteReader& in, std::size_t type) {
  if (type == 0) return in.U8() != 0;
  if (type == 1) {
    const std::uint64_t zigzag = in.Varint();
    return static_cast<std::int64_t>(zigzag >> 1) ^ -static_cast<std::int64_t>(zigzag & 1);
  }
  if (type == 2) return in.F64();
  const std::span<const std::uint8_t> text = in.Bytes(in.U8());
  return std::string(text.begin(), text.end());
}

}  // namespace

const PropertyValue* PropertySet::Find(std::size_t index) const {
  const auto at = std::find_if(values_.begin(), values_.end(), [&](const auto& entry) { return entry.first == index; });
  return at == values_.end() ? nullptr : &at->second;
}

absl::Status PropertySet::Set(std::span<const PropertyDef> defs, std::string_view name, PropertyValue value) {
  const std::optional<std::size_t> place = PlaceIn(defs, name);
  if (!place.has_value()) return absl::NotFoundError(absl::StrCat("no property \"", std::string(name), "\""));
  if (absl::Status status = Check(defs[*place], value); !status.ok()) return status;
  PropertySet changed = *this;
  const auto key = static_cast<std::uint8_t>(*place);
  const auto at = std::lower_bound(changed.values_.begin(), changed.values_.end(), key,
                                   [](const auto& entry, std::uint8_t wanted) { return entry.first < wanted; });
  if (at != changed.values_.end() && at->first == key) {
    at->second = std::move(value);
  } else {
    changed.values_.insert(at, {key, std::move(value)});
  }
  if (changed.Encode().size() > kMaxPropertyBytes) {
    return absl::ResourceExhaustedError(
        absl::StrCat("properties of one body take more than ", kMaxPropertyBytes, " bytes"));
  }
  *this = std::move(changed);
  return absl::OkStatus();
}

std::vector<std::uint8_t> PropertySet::Encode() const {
  ByteWriter out;
  for (const auto& [place, value] : values_) {
    out.U8(place);
    WriteValue(out, value);
  }
  return out.Take();
}

absl::StatusOr<PropertySet> PropertySet::Decode(std::span<const std::uint8_t> bytes,
                                                std::span<const PropertyDef> defs) {
  if (bytes.size() > kMaxPropertyBytes) return absl::InvalidArgumentError("properties: too long");
  PropertySet set;
  ByteReader in(bytes);
  in.Field("properties");
  while (in.remaining() > 0) {
    const std::uint8_t place = in.U8();
    if (place >= defs.size()) return absl::InvalidArgumentError("properties: not declared");
    if (!set.values_.empty() && place <= set.values_.back().first) {
      return absl::InvalidArgumentError("properties: out of order");
    }
    PropertyValue value = ReadValue(in, defs[place].initial.index());
    if (!in.ok()) return absl::InvalidArgumentError(in.error());
    if (absl::Status status = Check(defs[place], value); !status.ok()) return status;
    set.values_.emplace_back(place, std::move(value));
  }
  return set;
}

std::optional<PropertyValue> ValueOf(std::span<const PropertyDef> defs, const PropertySet& of_scene,
                                     const PropertySet& changed, std::string_view name) {
  const std::optional<std::size_t> place = PlaceIn(defs, name);
  if (!place.has_value()) return std::nullopt;
  if (const PropertyValue* value = changed.Find(*place)) return *value;
  if (const PropertyValue* value = of_scene.Find(*place)) return *value;
  return defs[*place].initial;
}

}  // namespace tessera
