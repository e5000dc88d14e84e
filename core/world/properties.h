// Properties: small typed fields that a game attaches to bodies: a class, a team, health, a name.
//
// A scene declares them, each with a name, a type and an initial value. A body of the scene may have another value, and
// a region changes values while the world runs. They go along when a body changes hands, and clients receive changes by
// the rules that hold for states.
//
//   PropertySet set;                                       // the values of one body that differ from the scene
//   absl::Status status = set.Set(scene.properties, "health", std::int64_t{80});
//   std::optional<PropertyValue> health = ValueOf(scene.properties, body_def.properties, set, "health");
//
// Thread rule: plain values.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace tessera {

using PropertyValue = std::variant<bool, std::int64_t, double, std::string>;

struct PropertyDef {
  std::string name;
  PropertyValue initial;  // its type is the property's
};

// Properties that one scene may declare: on the wire, one byte holds the place of each.
inline constexpr std::size_t kMaxProperties = 64;
inline constexpr std::size_t kMaxPropertyText = 63;
inline constexpr double kMaxPropertyReal = 1e18;  // sums and squares of a few stay finite
// Size of the encoded properties of one body, which have to fit a datagram beside the body.
inline constexpr std::size_t kMaxPropertyBytes = 512;

class PropertySet {
 public:
  bool empty() const { return values_.empty(); }
  const PropertyValue* Find(std::size_t index) const;
  // Errors: NOT_FOUND "no property \"mana\"", INVALID_ARGUMENT "property \"health\" is a whole number", "... is not
  // finite", "... longer than 63 bytes", RESOURCE_EXHAUSTED when all together get too long.
  absl::Status Set(std::span<const PropertyDef> defs, std::string_view name, PropertyValue value);

  // The same set gives the same bytes. At most kMaxPropertyBytes.
  std::vector<std::uint8_t> Encode() const;
  // Errors: INVALID_ARGUMENT: truncated, not declared, of another type, out of order, too long, not finite.
  static absl::StatusOr<PropertySet> Decode(std::span<const std::uint8_t> bytes, std::span<const PropertyDef> defs);

  friend bool operator==(const PropertySet&, const PropertySet&) = default;

 private:
  std::vector<std::pair<std::uint8_t, PropertyValue>> values_;  // ascending by place in the scene's list
};

// The value of a body's property: the changed one, else the one that the scene gives to the body, else the declared
// one. Nothing if the property is not declared.
std::optional<PropertyValue> ValueOf(std::span<const PropertyDef> defs, const PropertySet& of_scene,
                                     const PropertySet& changed, std::string_view name);

}  // namespace tessera
