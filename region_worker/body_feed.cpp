#include "region_worker/body_feed.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "core/region/catalog.h"
#include "core/world/properties.h"

namespace tessera::worker {
namespace {

// Whether a viewer would see a difference; how long a body has been still does not show.
bool LooksDifferent(const BodyState& a, const BodyState& b) {
  return !(a.position == b.position && a.orientation == b.orientation && a.linear_velocity == b.linear_velocity &&
           a.angular_velocity == b.angular_velocity && a.asleep == b.asleep);
}

const auto kById = [](const auto& body, BodyId id) { return body.id < id; };

}  // namespace

void BodyFeed::Note(Tick tick, std::span<const region::Departure> departures) {
  for (const region::Departure& departure : departures) {
    const RegionId to = departure.reason == region::DepartureReason::kHandedOver ? departure.to : RegionId();
    if (departure.reason == region::DepartureReason::kRemoved) {
      removals_.push_back({tick, {departure.body, departure.epoch, to}});
    } else {
      departures_.push_back({departure.body, departure.epoch, to});
    }
  }
}

void BodyFeed::ReleaseRemovals(Tick committed) {
  std::erase_if(removals_, [&](const Removal& removal) {
    if (removal.tick > committed) return false;
    departures_.push_back(removal.departure);
    return true;
  });
}

replication::BodyRecord BodyFeed::RecordOf(const Pushed& body) {
  replication::BodyRecord record{body.id, body.epoch, body.state, nullptr, body.traits};
  record.visible_to = body.audience.visible_to;
  record.team = body.audience.team;
  return record;
}

bool BodyFeed::IsHeldBack(BodyId id) const {
  return std::ranges::any_of(removals_, [id](const Removal& removal) { return removal.departure.id == id; });
}

void BodyFeed::Clear() {
  pushed_.clear();
  properties_.clear();
  departures_.clear();
  removals_.clear();
}

void BodyFeed::Push(const region::Region& region, replication::SnapshotHistory& history) {
  changed_.clear();
  pushing_.clear();
  ReleaseRemovals(region.committed_tick());
  auto before = pushed_.begin();
  // Bodies do not leave without a departure; if one ever does, its viewers must not keep it.
  const auto drop = [&] {
    const BodyId id = before->id;
    if (!removals_.empty() && IsHeldBack(id)) {
      pushing_.push_back(*before++);
      return;
    }
    ++before;
    const auto named = [&](const replication::DepartureRecord& d) { return d.id == id; };
    if (std::any_of(departures_.begin(), departures_.end(), named)) return;
    departures_.push_back({id, (before - 1)->epoch, RegionId()});
  };
  auto record = region.records().all().begin();
  const auto traits_of = [&](BodyId id) -> replication::BodyTraits {
    while (record != region.records().all().end() && record->body < id) ++record;
    if (record == region.records().all().end() || record->body != id) return {};
    replication::BodyTraits traits{record->game.jumps, record->game.tuning};
    traits.tuning.visible_to.reset();  // no client's business
    return traits;
  };
  for (const region::OwnedBody& body : region.owned()) {
    const BodyId id = body.def->id;
    while (before != pushed_.end() && before->id < id) drop();
    const bool known = before != pushed_.end() && before->id == id;
    if (region.IsHidden(id)) {
      // It is there still, and may be shown again under the same epoch.
      if (known) departures_.push_back({id, body.epoch, RegionId(), replication::DepartureRecord::Why::kOutOfInterest});
      if (known) ++before;
      continue;
    }
    const Pushed now{id, body.epoch, body.state, traits_of(id), region.AudienceOf(id)};
    if (!known || before->epoch != now.epoch || LooksDifferent(before->state, now.state) ||
        before->traits != now.traits || before->audience != now.audience) {
      changed_.push_back(RecordOf(now));
    }
    if (known) ++before;
    pushing_.push_back(now);
  }
  while (before != pushed_.end()) drop();
  pushed_.swap(pushing_);
  AddProperties(region);
  history.Push(region.tick(), changed_, departures_);
  departures_.clear();
}

void BodyFeed::Show(Told& told, std::span<const PropertyDef> defs) {
  told.shown = told.bytes;
  const auto restricted = [](const PropertyDef& def) { return def.visible_to != Visibility::kEveryone; };
  if (std::ranges::none_of(defs, restricted)) return;
  // A region's own bytes are sound; of others nobody sees anything.
  const PropertySet all = PropertySet::Decode(*told.bytes, defs).value_or(PropertySet());
  told.shown = std::make_shared<const std::vector<std::uint8_t>>(all.EncodeFor(defs, PropertySet::Viewer::kAnybody));
  const auto add = [&](PropertySet::Viewer viewer, region::OutputCommit::PropertyBytes& to) {
    auto bytes = std::make_shared<const std::vector<std::uint8_t>>(all.EncodeFor(defs, viewer));
    if (*bytes != *told.shown) to = std::move(bytes);
  };
  add(PropertySet::Viewer::kTeam, told.team);
  if (IsPlayerBody(told.body)) add(PropertySet::Viewer::kPlayer, told.own);
}

void BodyFeed::Attach(const Told& told, replication::BodyRecord& record) {
  record.properties = told.shown;
  record.own_properties = told.own;
  record.team_properties = told.team;
}

// Adds properties to each body that is pushed, because it may be new to the history, and pushes bodies of which nothing
// but the properties changed.
void BodyFeed::AddProperties(const region::Region& region) {
  telling_.clear();
  for (const region::KeptRecord& record : region.records().all()) {
    const region::OutputCommit::PropertyBytes& bytes = region.output().PropertiesOf(record);
    if (bytes != nullptr && !bytes->empty()) telling_.push_back({record.body, bytes, {}, {}, {}});
  }
  const auto moved = changed_.size();
  auto before = properties_.begin();
  for (Told& now : telling_) {
    while (before != properties_.end() && before->body < now.body) ++before;
    const bool same = before != properties_.end() && before->body == now.body && before->bytes == now.bytes;
    if (same) {
      now = *before;
    } else {
      Show(now, region.catalog().scene().properties);
    }
    const auto end = changed_.begin() + static_cast<std::ptrdiff_t>(moved);
    if (const auto at = std::lower_bound(changed_.begin(), end, now.body, kById); at != end && at->id == now.body) {
      Attach(now, *at);
    } else if (!same) {
      const auto body = std::lower_bound(pushed_.begin(), pushed_.end(), now.body, kById);
      if (body == pushed_.end() || body->id != now.body) continue;  // not owned; should not happen
      changed_.push_back(RecordOf(*body));
      Attach(now, changed_.back());
    }
  }
  properties_.swap(telling_);
}

std::optional<Vec3d> BodyFeed::PlaceOf(BodyId id) const {
  const auto body = std::lower_bound(pushed_.begin(), pushed_.end(), id, kById);
  if (body == pushed_.end() || body->id != id) return std::nullopt;
  return body->state.position;
}

TeamId BodyFeed::TeamOf(BodyId id) const {
  const auto body = std::lower_bound(pushed_.begin(), pushed_.end(), id, kById);
  return body == pushed_.end() || body->id != id ? 0 : body->audience.team;
}

}  // namespace tessera::worker
