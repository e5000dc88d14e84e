// PropertyTable: what has been changed of the properties of the bodies that a region owns.
//
// Only bodies whose properties differ from what the scene gives them have a place here, so a world without properties
// pays nothing for them. Changes are numbered by whoever orders them, and the number of a body's last one goes wherever
// the body goes: one that is ordered again, after a handover or a death, is applied once, and none comes after a later
// one. Thread rule: one thread at a time.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "core/world/ids.h"
#include "core/world/properties.h"

namespace tessera::region {

class Catalog;

// As a body takes them along: in a grant, in the log, in a saved state.
struct CarriedProperties {
  std::uint64_t change = 0;         // number of the last one; 0: none, and no bytes
  std::vector<std::uint8_t> bytes;  // PropertySet::Encode of what differs from what the scene gives the body
  bool empty() const { return change == 0; }
  friend bool operator==(const CarriedProperties&, const CarriedProperties&) = default;
};
// INVALID_ARGUMENT "body 7: properties: not declared", "... truncated" and so on.
absl::Status CheckProperties(BodyId id, const CarriedProperties& properties, const Catalog& catalog);

// The same, of a body that is owned here. The bytes never change: another change makes others.
struct ChangedProperties {
  BodyId body;
  std::uint64_t change = 0;
  std::shared_ptr<const std::vector<std::uint8_t>> bytes;
};

class PropertyTable {
 public:
  // Ascending by body.
  std::span<const ChangedProperties> all() const { return all_; }
  const ChangedProperties* Find(BodyId id) const;
  // The properties that the body takes along; empty if none was changed.
  CarriedProperties Of(BodyId id) const;

  // Sets one of those that the scene declares. Errors: as PropertySet::Set. A change whose number is not above the last
  // one's of that body does nothing. Requires `change` > 0.
  absl::Status Set(BodyId id, std::span<const PropertyDef> defs, std::string_view name, PropertyValue value,
                   std::uint64_t change);
  // A body that is owned here from now on, and one that is not any more. The bytes of `properties` are sound.
  void Adopt(BodyId id, const CarriedProperties& properties);
  void Release(BodyId id);

  // Notes for the log which are new, from now on or no more.
  void KeepNews(bool on);
  // Those that were changed or adopted since the last call, ascending.
  std::vector<ChangedProperties> TakeNews();

  void Validate() const;

 private:
  void Put(ChangedProperties entry);

  std::vector<ChangedProperties> all_;
  bool keep_news_ = false;
  std::vector<BodyId> news_;
};

}  // namespace tessera::region
