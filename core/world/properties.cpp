#include "core/world/properties.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

#include "absl/strings/str_cat.h"
#include "core/world/bytes.h"
#include "core/world/player_name.h"

namespace tessera {
namespace {

constexpr const char* kTypeNames[] = {"true or false", "a whole number", "a number", "a text",
                                      "a vector",      "a body",         "bytes"};
static_assert(std::size(kTypeNames) == std::variant_size_v<PropertyValue>);

// Stands for the player's name, after all places of properties.
constexpr std::uint8_t kNamePlace = 255;
static_assert(kMaxProperties <= kNamePlace);

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
  const auto reals = [](const PropertyValue& of) -> std::array<double, 3> {
    if (const double* number = std::get_if<double>(&of)) return {*number, 0, 0};
    if (const Vec3d* vector = std::get_if<Vec3d>(&of)) return {vector->x, vector->y, vector->z};
    return {0, 0, 0};
  };
  for (const double number : reals(value)) {
    if (!std::isfinite(number)) return wrong("is not finite");
    if (std::abs(number) > kMaxPropertyReal) return wrong(absl::StrCat("is beyond ", kMaxPropertyReal));
  }
  if (const std::string* text = std::get_if<std::string>(&value); text != nullptr && text->size() > kMaxPropertyText) {
    return wrong(absl::StrCat("is longer than ", kMaxPropertyText, " bytes"));
  }
  if (const auto* blob = std::get_if<PropertyBytes>(&value); blob != nullptr && blob->bytes.size() > kMaxPropertyBlob) {
    return wrong(absl::StrCat("is longer than ", kMaxPropertyBlob, " bytes"));
  }
  return absl::OkStatus();
}

struct ValueWriter {
  ByteWriter& out;
  void operator()(bool flag) const { out.U8(flag ? 1 : 0); }
  void operator()(std::int64_t number) const {
    out.Varint((static_cast<std::uint64_t>(number) << 1) ^ static_cast<std::uint64_t>(number >> 63));
  }
  void operator()(double number) const { out.F64(number); }
  void operator()(const std::string& text) const {
    out.U8(static_cast<std::uint8_t>(text.size()));
    out.Text(text);
  }
  void operator()(const Vec3d& vector) const { out.V(vector); }
  void operator()(BodyId body) const { out.Varint(body.value()); }
  void operator()(const PropertyBytes& blob) const { out.Block(blob.bytes); }
};

PropertyValue ReadValue(ByteReader& in, std::size_t type) {
  switch (type) {
    case 0:
      return in.U8() != 0;
    case 1: {
      const std::uint64_t zigzag = in.Varint();
      return static_cast<std::int64_t>(zigzag >> 1) ^ -static_cast<std::int64_t>(zigzag & 1);
    }
    case 2:
      return in.F64();
    case 3: {
      const std::span<const std::uint8_t> text = in.Bytes(in.U8());
      return std::string(text.begin(), text.end());
    }
    case 4:
      return in.V3d();
    case 5:
      return BodyId(in.Varint());
    default: {
      const std::span<const std::uint8_t> bytes = in.Block(kMaxPropertyBlob);
      return PropertyBytes{{bytes.begin(), bytes.end()}};
    }
  }
}

void WriteEntry(ByteWriter& out, std::uint8_t place, const PropertyValue& value) {
  out.U8(place);
  std::visit(ValueWriter{out}, value);
}

// Comes last.
void WriteName(ByteWriter& out, const std::string& name) {
  if (name.empty()) return;
  out.U8(kNamePlace);
  out.U8(static_cast<std::uint8_t>(name.size()));
  out.Text(name);
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

TeamId TeamOf(const PropertyValue& value) {
  TeamId hash = 0xcbf29ce484222325;  // FNV-1a
  const auto mix = [&hash](std::uint8_t byte) { hash = (hash ^ byte) * 0x100000001b3; };
  if (const auto* text = std::get_if<std::string>(&value)) {
    if (text->empty()) return 0;
    for (const char c : *text) mix(static_cast<std::uint8_t>(c));
  } else if (const auto* number = std::get_if<std::int64_t>(&value)) {
    if (*number == 0) return 0;
    for (int shift = 0; shift < 64; shift += 8)
      mix(static_cast<std::uint8_t>(static_cast<std::uint64_t>(*number) >> shift));
  } else {
    return 0;
  }
  return std::max<TeamId>(hash, 1);
}

std::vector<std::uint8_t> PropertySet::Encode() const {
  ByteWriter out;
  for (const auto& [place, value] : values_) WriteEntry(out, place, value);
  WriteName(out, player_name_);
  return out.Take();
}

std::vector<std::uint8_t> PropertySet::EncodeFor(std::span<const PropertyDef> defs, Viewer viewer) const {
  const auto sees = [viewer](Visibility visible_to) {
    switch (visible_to) {
      case Visibility::kEveryone:
        return true;
      case Visibility::kTeam:
        return viewer != Viewer::kAnybody;
      case Visibility::kPlayer:
        return viewer == Viewer::kPlayer;
      default:
        return false;
    }
  };
  ByteWriter out;
  for (const auto& [place, value] : values_) {
    if (sees(defs[place].visible_to)) WriteEntry(out, place, value);
  }
  WriteName(out, player_name_);
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
    if (!set.player_name_.empty()) return absl::InvalidArgumentError("properties: out of order");
    if (place == kNamePlace) {
      const std::span<const std::uint8_t> name = in.Bytes(in.U8());
      if (!in.ok()) return absl::InvalidArgumentError(in.error());
      set.player_name_.assign(name.begin(), name.end());
      if (set.player_name_.empty()) return absl::InvalidArgumentError("properties: player_name: is empty");
      if (const absl::Status status = CheckPlayerName(set.player_name_); !status.ok()) {
        return absl::InvalidArgumentError(absl::StrCat("properties: ", status.message()));
      }
      continue;
    }
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

std::vector<std::string_view> ChangedProperties(std::span<const PropertyDef> defs, const PropertySet& before,
                                                const PropertySet& after) {
  std::vector<std::string_view> names;
  for (std::size_t i = 0; i < defs.size(); ++i) {
    const PropertyValue *was = before.Find(i), *is = after.Find(i);
    const bool same = was == nullptr || is == nullptr ? was == is : *was == *is;
    if (!same) names.push_back(defs[i].name);
  }
  return names;
}

std::string PropertyText(const PropertyValue& value) {
  struct Writer {
    std::string operator()(bool flag) const { return flag ? "true" : "false"; }
    std::string operator()(std::int64_t number) const { return absl::StrCat(number); }
    std::string operator()(double number) const { return absl::StrCat(number); }
    std::string operator()(const std::string& text) const { return absl::StrCat("\"", text, "\""); }
    std::string operator()(const Vec3d& v) const { return absl::StrCat("(", v.x, ", ", v.y, ", ", v.z, ")"); }
    std::string operator()(BodyId id) const { return id == BodyId() ? "no body" : absl::StrCat("body ", id.value()); }
    std::string operator()(const PropertyBytes& blob) const { return absl::StrCat(blob.bytes.size(), " bytes"); }
  };
  return std::visit(Writer(), value);
}

}  // namespace tessera
