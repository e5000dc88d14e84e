#include "control_plane/cluster/upgrades.h"

#include "absl/strings/str_cat.h"
#include "control_plane/change.h"
#include "control_plane/cluster/planned_changes.h"
#include "control_plane/instance_record.h"
#include "control_plane/world_terms.h"

namespace tessera::control {

absl::StatusOr<std::optional<records::Instance>> Upgrades::Begin(const InstanceEntry& instance, Now now) {
  if (instance.record.has_upgrade()) {
    return absl::FailedPreconditionError(absl::StrCat("id: ", instance.record.id(), " is being upgraded already"));
  }
  records::Instance next = instance.record;
  next.mutable_upgrade()->set_paused(!next.clock().paused());
  next.mutable_clock()->set_paused(true);
  AddEvent(next, now, "to be upgraded: it stands after one tick, and begins anew from there");
  return next;
}

std::optional<std::uint64_t> Upgrades::Tick(const InstanceEntry& instance) {
  const records::Instance& record = instance.record;
  if (!record.has_upgrade() || !IsPaused(record) || !AtRest(record)) return std::nullopt;
  return StandingTick(instance);
}

std::optional<records::Instance> Upgrades::End(const InstanceEntry& instance, const std::string& text, Now now) {
  under_way_.erase(instance.number);
  if (!instance.record.has_upgrade()) return std::nullopt;
  records::Instance next = instance.record;
  if (next.upgrade().paused()) {
    next.mutable_clock()->set_paused(false);
    ForgetStep(next);
  }
  next.clear_upgrade();
  AddEvent(next, now, text);
  return next;
}

std::optional<records::Instance> Upgrades::EndAbandoned(const InstanceEntry& instance, Now now) {
  if (under_way_.contains(instance.number)) return std::nullopt;
  return End(instance, "not upgraded: nobody carries it out any more, and it goes on as it was", now);
}

}  // namespace tessera::control
