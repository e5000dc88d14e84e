// Properties: small typed fields that a game attaches to bodies: a class, a team, health, a name.
//
// A scene declares them, each with a name, a type, an initial value and who may see it. A body of the scene may have
// another value, and a region changes values while the world runs. They go along when a body changes hands, and clients
// receive changes by the rules that hold for states.
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
#include "core/world/ids.h"
#include "core/world/math.h"

namespace tessera {

// A value that only the game understands.
struct PropertyBytes {
  std::vector<std::uint8_t> bytes;  // at most kMaxPropertyBlob
  friend bool operator==(const PropertyBytes&, const PropertyBytes&) = default;
};

// A BodyId refers to another body, which need not be there; 0: to none.
using PropertyValue = std::variant<bool, std::int64_t, double, std::string, Vec3d, BodyId, PropertyBytes>;

using NamedProperty = std::pair<std::string, PropertyValue>;

// Which clients see a property, or a body.
enum class Visibility : std::uint8_t {
  kEveryone,
  kPlayer,   // a player's body: that player alone; any other body: nobody. Only for properties
  kServers,  // no client
  kTeam,     // the players of the body's team
};

// Bodies of one team have equal numbers; 0: in none. It follows from the value of the scene's team property alone, and
// two values have one number with a chance of 2^-64.
using TeamId = std::uint64_t;
TeamId TeamOf(const PropertyValue& value);
// Whether a player of team `viewer` may see a body of another player, or of nobody, that is visible so.
constexpr bool MaySee(Visibility visible_to, TeamId team, TeamId viewer) {
  return visible_to == Visibility::kEveryone || (visible_to == Visibility::kTeam && viewer != 0 && team == viewer);
}

struct PropertyDef {
  std::string name;
  PropertyValue initial;  // its type is the property's
  Visibility visible_to = Visibility::kEveryone;
};

// Properties that one scene may declare: on the wire, one byte holds the place of each.
inline constexpr std::size_t kMaxProperties = 64;
inline constexpr std::size_t kMaxPropertyText = 63;
inline constexpr std::size_t kMaxPropertyBlob = 256;
inline constexpr double kMaxPropertyReal = 1e18;  // sums and squares of a few stay finite; of a vector's parts as well
// Size of the encoded properties of one body, which have to fit a datagram beside the body.
inline constexpr std::size_t kMaxPropertyBytes = 512;

class PropertySet {
 public:
  bool empty() const { return values_.empty() && player_name_.empty(); }
  const PropertyValue* Find(std::size_t index) const;
  // Errors: NOT_FOUND "no property \"mana\"", INVALID_ARGUMENT "property \"health\" is a whole number", "... is not
  // finite", "... longer than 63 bytes", RESOURCE_EXHAUSTED when all together get too long.
  absl::Status Set(std::span<const PropertyDef> defs, std::string_view name, PropertyValue value);

  // The name of the player whose body has the set (player_name.h); empty for other bodies. It travels with what was
  // changed, so that whoever learns of the body learns of the name.
  const std::string& player_name() const { return player_name_; }
  void set_player_name(std::string name) { player_name_ = std::move(name); }

  // The same set gives the same bytes. At most kMaxPropertyBytes.
  std::vector<std::uint8_t> Encode() const;
  // A viewer stands in one of these relations to a body; its own player sees all that its team sees.
  enum class Viewer : std::uint8_t { kAnybody, kTeam, kPlayer };
  // The same of those that such a client may see. Values that the scene gives are no secret, because a client has the
  // scene.
  std::vector<std::uint8_t> EncodeFor(std::span<const PropertyDef> defs, Viewer viewer) const;
  // Errors: INVALID_ARGUMENT: truncated, not declared, of another type, out of order, too long, not finite, a bad name.
  static absl::StatusOr<PropertySet> Decode(std::span<const std::uint8_t> bytes, std::span<const PropertyDef> defs);

  friend bool operator==(const PropertySet&, const PropertySet&) = default;

 private:
  std::vector<std::pair<std::uint8_t, PropertyValue>> values_;  // ascending by place in the scene's list
  std::string player_name_;
};

// The value of a body's property: the changed one, else the one that the scene gives to the body, else the declared
// one. Nothing if the property is not declared.
std::optional<PropertyValue> ValueOf(std::span<const PropertyDef> defs, const PropertySet& of_scene,
                                     const PropertySet& changed, std::string_view name);

// Names of the declared properties that differ between two states of a body, in the order of their declaration.
std::vector<std::string_view> ChangedProperties(std::span<const PropertyDef> defs, const PropertySet& before,
                                                const PropertySet& after);

// For people: `true`, `-7`, `1.5`, `"red"`, `(1, 2, 3)`, `body 17`, `no body`, `3 bytes`.
std::string PropertyText(const PropertyValue& value);

}  // namespace tessera
