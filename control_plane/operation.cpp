#include "control_plane/operation.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "control_plane/change.h"
#include "control_plane/world_terms.h"

namespace tessera::control {
namespace {

// Something that was asked for, or that died, is not made up for yet: the next map is for that.
bool IsOwed(const records::Instance& record) {
  const bool replaces = std::any_of(record.placements().begin(), record.placements().end(), [&](const auto& placement) {
    return placement.incarnation() <= record.replace_up_to();
  });
  const bool scales = record.wanted_regions() != 0 &&
                      record.wanted_regions() != static_cast<std::uint32_t>(record.map().regions_size());
  return replaces || scales || record.games().has_next() || record.clock().paused() != IsPaused(record) ||
         record.clock().ticks_per_second() != record.map().terms().ticks_per_second();
}

bool WishesDiffer(const records::Instance& a, const records::Instance& b) {
  return a.wanted_regions() != b.wanted_regions() || a.replace_up_to() < b.replace_up_to() ||
         a.clock().paused() != b.clock().paused() || a.clock().ticks_per_second() != b.clock().ticks_per_second() ||
         (b.games().has_next() && a.games().next().hash() != b.games().next().hash()) ||
         (b.has_upgrade() && !a.has_upgrade());
}

// The events of `next` that `before` lacks: the oldest go when there are many, so numbers say nothing.
int FirstNewEvent(const records::Instance& before, const records::Instance& next) {
  if (before.events().empty()) return 0;
  const std::string last = before.events().rbegin()->SerializeAsString();
  for (int i = next.events_size(); i > 0; --i) {
    if (next.events(i - 1).SerializeAsString() == last) return i;
  }
  return 0;
}

}  // namespace

bool BeginsOperation(const records::Instance& before, const records::Instance& next) {
  const bool stops = next.state() != before.state() && next.state() == v1::INSTANCE_STATE_STOPPING;
  const bool restores = next.restored().last_incarnation() != before.restored().last_incarnation();
  const bool fails_over = next.has_failover() && !before.has_failover();
  const bool plans = next.has_planned() && !before.has_planned() && AtRest(before) && !IsOwed(before);
  return stops || restores || fails_over || plans || WishesDiffer(before, next);
}

NamedRecord NameOperation(const records::Instance& before, const records::Instance& next, const std::string& id) {
  NamedRecord named{.record = next, .begins = BeginsOperation(before, next), .lines = {}};
  if (named.begins) named.record.set_operation(id);
  for (int i = FirstNewEvent(before, next); i < named.record.events_size(); ++i) {
    v1::InstanceEvent& event = *named.record.mutable_events(i);
    event.set_operation(named.record.operation());
    named.lines.push_back(absl::StrCat("event id=", next.id(), " op=", event.operation(), ": ", event.text()));
  }
  return named;
}

}  // namespace tessera::control
