// RecordTable: what the bodies that a region owns have beside their states: changed properties, and what a game keeps
// with them.
//
// Only bodies that have something have a place here, so a world without properties and without a game pays nothing.
// Changes that are ordered from outside are numbered by whoever orders them, and the number of a body's last one goes
// wherever the body goes: one that is ordered again, after a handover or a death, is applied once, and none comes after
// a later one. What a game changes has no number; its region commits it.
//
// Thread rule: one thread at a time.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "core/game/record.h"
#include "core/region/record_list.h"
#include "core/world/ids.h"
#include "core/world/properties.h"

namespace tessera::region {

class Catalog;

using PropertyPointer = std::shared_ptr<const std::vector<std::uint8_t>>;  // PropertySet::Encode

// As a body takes it along: in a grant, in the log, in a saved state.
struct CarriedRecord {
  std::uint64_t change = 0;  // number of the last ordered change; 0: none
  std::vector<std::uint8_t>
      bytes;  // PropertySet::Encode of what differs from what the scene gives the body, or nothing
  game::GameRecord game = {};
  bool empty() const { return change == 0 && bytes.empty() && game.empty(); }
  friend bool operator==(const CarriedRecord&, const CarriedRecord&) = default;
};
// INVALID_ARGUMENT "body 7: properties: not declared", "... truncated", "body 7: timers: out of order" and so on.
absl::Status CheckRecord(BodyId id, const CarriedRecord& record, const Catalog& catalog);

// The same, of a body that is owned here. Bytes never change: another change makes others.
struct KeptRecord {
  BodyId body;
  std::uint64_t change = 0;
  std::shared_ptr<const std::vector<std::uint8_t>> bytes;  // none changed: empty
  game::GameRecord game = {};
};
CarriedRecord CarriedFrom(const KeptRecord& record);

class RecordTable {
 public:
  // Ascending by body.
  RecordList all() const { return RecordList(all_); }
  const KeptRecord* Find(BodyId id) const;
  // The record that the body takes along; empty if it has none.
  CarriedRecord Of(BodyId id) const;
  // Bodies with a timer that is due by `tick`, ascending.
  std::vector<BodyId> DueBy(Tick tick) const;
  // Those of bodies to which a game does anything in the next step, ascending; valid until one of them changes.
  std::vector<const KeptRecord*> Acting() const;
  bool AnyActs() const { return !acting_.empty(); }

  // Bodies of players with commands that wait for the game, and of those who take no part in the world; both ascending.
  std::span<const BodyId> commanded() const { return commanded_; }
  std::span<const BodyId> hidden() const { return hidden_; }
  // Bodies of players whose inputs a game has given limits, ascending.
  std::span<const BodyId> limited() const { return limited_; }

  // Sets one of the properties that the scene declares. Errors: as PropertySet::Set. A change whose number is not above
  // the last one's of that body does nothing. Requires `change` > 0.
  absl::Status Set(BodyId id, std::span<const PropertyDef> defs, std::string_view name, PropertyValue value,
                   std::uint64_t change);
  // The record that there was before a change; nothing if there was none.
  struct Replaced {
    bool changed = false;
    std::optional<KeptRecord> before;
  };
  // A call of a game has ended: the body's properties and record as it left them.
  Replaced Commit(BodyId id, const PropertySet& changed, game::GameRecord record);
  // The record of a body that is owned here becomes this.
  void Put(BodyId id, const game::GameRecord& record);
  // The step to `tick` is about to be made, with all that acts in it.
  void Acted(Tick tick);
  // Records that sent messages which are not acknowledged, or remember senders of some; ascending.
  const std::set<BodyId>& mailing() const { return mailing_; }
  // Bodies whose records have joints, ascending.
  const std::set<BodyId>& jointed() const { return jointed_; }
  // Bodies that a player who is not theirs moves, or is to move, and bodies of such players; ascending.
  const std::set<BodyId>& steering() const { return steering_; }
  // Records with questions that are not answered; ascending.
  const std::set<BodyId>& asking() const { return asking_; }
  // Bodies that brought along events whose turn has not come; ascending.
  const std::set<BodyId>& eventful() const { return eventful_; }
  // A body that is owned here from now on, and one that is not any more. What is carried is sound.
  void Adopt(BodyId id, const CarriedRecord& record);
  void Release(BodyId id);

  // Notes for the log which are new, from now on or no more.
  void KeepNews(bool on);
  // Those that were changed or adopted since the last call, ascending.
  std::vector<KeptRecord> TakeNews();

  void Validate() const;

 private:
  std::optional<KeptRecord> Put(KeptRecord entry);  // in whose place
  std::size_t PlaceOf(BodyId id) const;             // the first whose body is not before this one
  void IncludePlayer(const KeptRecord& entry);

  std::vector<RecordPlace> all_;
  std::set<std::pair<Tick, BodyId>> due_;             // the first timer of each body; written with all_
  std::set<BodyId> acting_;                           // written with all_
  std::set<BodyId> mailing_;                          // written with all_
  std::set<BodyId> jointed_;                          // written with all_
  std::set<BodyId> asking_;                           // written with all_
  std::set<BodyId> steering_;                         // written with all_
  std::set<BodyId> eventful_;                         // written with all_
  std::vector<BodyId> commanded_, hidden_, limited_;  // ascending, written with all_
  bool keep_news_ = false;
  std::vector<BodyId> news_;
};

}  // namespace tessera::region
