#include "core/region/record_table.h"

#include <algorithm>
#include <cassert>

#include "absl/strings/str_cat.h"
#include "core/region/ascends.h"
#include "core/region/catalog.h"

namespace tessera::region {
namespace {

// Whether an ascending list has the body, made so.
void Include(BodyId id, bool there, std::vector<BodyId>& list) {
  const auto at = std::lower_bound(list.begin(), list.end(), id);
  const bool known = at != list.end() && *at == id;
  if (there && !known) list.insert(at, id);
  if (!there && known) list.erase(at);
}

}  // namespace

absl::Status CheckRecord(BodyId id, const CarriedRecord& record, const Catalog& catalog) {
  const auto bad = [id](absl::string_view what) {
    return absl::InvalidArgumentError(absl::StrCat("body ", id.value(), ": ", what));
  };
  if (record.bytes.empty() && record.change != 0) return bad("properties: changed to nothing");
  if (const absl::Status game = game::CheckRecord(record.game); !game.ok()) return bad(game.message());
  if (const absl::Status joints = game::CheckJointsOf(id, record.game.joints); !joints.ok())
    return bad(joints.message());
  for (const game::GameJoint& joint : record.game.joints) {
    if (!catalog.Known(joint.other) || joint.other == kInstanceBody) return bad("joints: to no body of the scene");
  }
  for (const game::GameQuestion& question : record.game.questions) {
    const auto query = game::DecodeQuestion(question.query, catalog.scene());
    if (!query.ok()) return bad(query.status().message());
  }
  if (!record.game.player.empty() && !IsPlayerBody(id)) return bad("player: is no player's");
  if (record.game.driver != PlayerNumber() && IsPlayerBody(id)) return bad("driver: of a player's body");
  if (record.bytes.empty()) return absl::OkStatus();
  const Scene& scene = catalog.scene();
  const auto set =
      PropertySet::Decode(record.bytes, id == kInstanceBody ? scene.instance_properties : scene.properties);
  if (!set.ok()) return bad(set.status().message());
  if (!set->player_name().empty() && !IsPlayerBody(id)) return bad("properties: a player's name");
  return absl::OkStatus();
}

CarriedRecord CarriedFrom(const KeptRecord& record) { return {record.change, *record.bytes, record.game}; }

std::size_t RecordTable::PlaceOf(BodyId id) const {
  const auto at = std::ranges::lower_bound(all_, id, {}, &RecordPlace::body);
  return static_cast<std::size_t>(at - all_.begin());
}

const KeptRecord* RecordTable::Find(BodyId id) const {
  const std::size_t place = PlaceOf(id);
  return place < all_.size() && all_[place].body == id ? all_[place].record.get() : nullptr;
}

CarriedRecord RecordTable::Of(BodyId id) const {
  const KeptRecord* entry = Find(id);
  return entry == nullptr ? CarriedRecord() : CarriedFrom(*entry);
}

std::vector<BodyId> RecordTable::DueBy(Tick tick) const {
  std::vector<BodyId> bodies;
  for (auto at = due_.begin(); at != due_.end() && at->first <= tick; ++at) bodies.push_back(at->second);
  std::sort(bodies.begin(), bodies.end());
  return bodies;
}

std::vector<const KeptRecord*> RecordTable::Acting() const {
  std::vector<const KeptRecord*> acting;
  acting.reserve(acting_.size());
  for (const BodyId id : acting_) acting.push_back(Find(id));
  return acting;
}

absl::Status RecordTable::Set(BodyId id, std::span<const PropertyDef> defs, std::string_view name, PropertyValue value,
                              std::uint64_t change) {
  assert(change > 0);
  PropertySet set;
  if (const KeptRecord* entry = Find(id); entry != nullptr) {
    if (change <= entry->change) return absl::OkStatus();
    absl::StatusOr<PropertySet> now = PropertySet::Decode(*entry->bytes, defs);
    if (!now.ok()) return now.status();
    set = *std::move(now);
  }
  if (absl::Status status = set.Set(defs, name, std::move(value)); !status.ok()) return status;
  const KeptRecord* entry = Find(id);
  Put({id, change, std::make_shared<const std::vector<std::uint8_t>>(set.Encode()),
       entry == nullptr ? game::GameRecord() : entry->game});
  return absl::OkStatus();
}

RecordTable::Replaced RecordTable::Commit(BodyId id, const PropertySet& changed, game::GameRecord record) {
  const KeptRecord* entry = Find(id);
  std::vector<std::uint8_t> bytes = changed.Encode();
  if (entry == nullptr && bytes.empty() && record.empty()) return {};
  const bool same_properties = entry != nullptr && *entry->bytes == bytes;
  if (same_properties && entry->game == record) return {};
  // Snapshots tell that properties did not change by the address of their bytes.
  return {true,
          Put({id, entry == nullptr ? 0 : entry->change,
               same_properties ? entry->bytes : std::make_shared<const std::vector<std::uint8_t>>(std::move(bytes)),
               std::move(record)})};
}

void RecordTable::Put(BodyId id, const game::GameRecord& record) {
  const KeptRecord* known = Find(id);
  if (known != nullptr ? known->game == record : record.empty()) return;
  KeptRecord entry = known != nullptr ? *known : KeptRecord{id, 0, std::make_shared<const std::vector<std::uint8_t>>()};
  entry.game = record;
  Put(std::move(entry));
}

void RecordTable::Acted(Tick tick) {
  const std::vector<BodyId> acting(acting_.begin(), acting_.end());
  for (const BodyId id : acting) {
    game::GameRecord record = Find(id)->game;
    record.Acted(tick);
    Put(id, record);
  }
}

void RecordTable::Adopt(BodyId id, const CarriedRecord& record) {
  if (record.empty()) return Release(id);
  Put({id, record.change, std::make_shared<const std::vector<std::uint8_t>>(record.bytes), record.game});
}

void RecordTable::IncludePlayer(const KeptRecord& entry) {
  if (!IsPlayerBody(entry.body)) return;
  Include(entry.body, !entry.game.player->commands.empty(), commanded_);
  Include(entry.body, entry.game.player->hidden(), hidden_);
  Include(entry.body, !entry.game.player->limits.empty(), limited_);
}

std::optional<KeptRecord> RecordTable::Put(KeptRecord entry) {
  const BodyId id = entry.body;
  if (keep_news_) news_.push_back(id);
  const std::size_t place = PlaceOf(id);
  KeptRecord* const known = place < all_.size() && all_[place].body == id ? all_[place].record.get() : nullptr;
  if (known != nullptr && known->game.next_due()) due_.erase({*known->game.next_due(), id});
  if (entry.game.next_due()) due_.emplace(*entry.game.next_due(), id);
  if (entry.game.acts()) {
    acting_.insert(id);
  } else {
    acting_.erase(id);
  }
  if (entry.game.mail.outbox.empty() && entry.game.mail.senders.empty()) {
    mailing_.erase(id);
  } else {
    mailing_.insert(id);
  }
  if (entry.game.joints.empty()) {
    jointed_.erase(id);
  } else {
    jointed_.insert(id);
  }
  if (entry.game.driver == PlayerNumber() && entry.game.player->controls == BodyId()) {
    steering_.erase(id);
  } else {
    steering_.insert(id);
  }
  if (entry.game.questions.empty()) {
    asking_.erase(id);
  } else {
    asking_.insert(id);
  }
  if (entry.game.waiting.empty()) {
    eventful_.erase(id);
  } else {
    eventful_.insert(id);
  }
  IncludePlayer(entry);
  if (known != nullptr) return std::exchange(*known, std::move(entry));
  all_.insert(all_.begin() + static_cast<std::ptrdiff_t>(place),
              RecordPlace{id, std::make_unique<KeptRecord>(std::move(entry))});
  return std::nullopt;
}

void RecordTable::Release(BodyId id) {
  const std::size_t place = PlaceOf(id);
  if (place == all_.size() || all_[place].body != id) return;
  const KeptRecord& entry = *all_[place].record;
  if (entry.game.next_due()) due_.erase({*entry.game.next_due(), id});
  acting_.erase(id);
  mailing_.erase(id);
  jointed_.erase(id);
  asking_.erase(id);
  steering_.erase(id);
  eventful_.erase(id);
  IncludePlayer({id, 0, nullptr, {}});
  all_.erase(all_.begin() + static_cast<std::ptrdiff_t>(place));
}

void RecordTable::KeepNews(bool on) {
  keep_news_ = on;
  news_.clear();
}

std::vector<KeptRecord> RecordTable::TakeNews() {
  std::sort(news_.begin(), news_.end());
  news_.erase(std::unique(news_.begin(), news_.end()), news_.end());
  std::vector<KeptRecord> news;
  news.reserve(news_.size());
  for (const BodyId id : news_) {
    if (const KeptRecord* entry = Find(id); entry != nullptr) news.push_back(*entry);
  }
  news_.clear();
  return news;
}

void RecordTable::Validate() const {
  assert(Ascends(all_, &RecordPlace::body));
  assert(due_.size() == static_cast<std::size_t>(std::ranges::count_if(
                            all_, [](const RecordPlace& entry) { return entry.record->game.next_due().has_value(); })));
  assert(acting_.size() == static_cast<std::size_t>(std::ranges::count_if(
                               all_, [](const RecordPlace& entry) { return entry.record->game.acts(); })));
}

}  // namespace tessera::region
