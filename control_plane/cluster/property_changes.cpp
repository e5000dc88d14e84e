#include "control_plane/cluster/property_changes.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "control_plane/control_settings.h"
#include "control_plane/instance_record.h"
#include "control_plane/life.h"
#include "control_plane/one_line.h"
#include "core/world/proto_math.h"

namespace tessera::control {
namespace {

// As far as can be checked here.
absl::Status CheckChange(const InstanceEntry& instance, const v1::SetPropertyRequest& request) {
  const records::Instance& record = instance.record;
  const bool world = request.body() == 0;
  if (world && record.game_name().empty()) {
    return absl::FailedPreconditionError(
        absl::StrCat("body: ", record.id(), " runs no game, and the world has properties for its game alone"));
  }
  if (!world && !HasBody(record, instance.players, BodyId(request.body()))) {
    return absl::NotFoundError(absl::StrCat("body: ", record.id(), " has no dynamic body ", request.body()));
  }
  const auto& all = world ? record.world_properties() : record.properties();
  std::vector<PropertyDef> defs;
  defs.reserve(static_cast<std::size_t>(all.size()));
  for (const v1::Property& declared : all) {
    defs.push_back({declared.name(), FromProto(declared).value_or(PropertyValue())});
  }
  const v1::Property& property = request.property();
  const std::string name = OneLine(property.name(), kMaxNameBytes);
  const std::optional<PropertyValue> value = FromProto(property);
  if (!value) return absl::InvalidArgumentError(absl::StrCat("property: \"", name, "\" has no value"));
  const absl::Status status = PropertySet().Set(defs, name, *value);
  const char* field = absl::IsNotFound(status) ? "property.name: " : "property: ";
  return status.ok() ? status : absl::Status(status.code(), absl::StrCat(field, status.message()));
}

}  // namespace

absl::StatusOr<std::uint64_t> PropertyChanges::Add(InstanceEntry& instance, const v1::SetPropertyRequest& request) {
  if (absl::Status status = CheckChange(instance, request); !status.ok()) return status;
  std::vector<Pending>& pending = pending_[instance.number];
  if (pending.size() >= kMaxPropertyChanges) {
    return absl::ResourceExhaustedError(
        absl::StrCat("id: ", pending.size(), " changes of ", request.id(), " wait already"));
  }
  if (request.validate_only()) return 0;
  v1::PropertyChange& change = pending.emplace_back().change;
  change.set_number(state_.NextRevision());
  change.set_body(request.body());
  *change.mutable_property() = request.property();
  state_.MarkOrders(instance);
  state_.MarkChanged(instance);
  return change.number();
}

std::optional<absl::Status> PropertyChanges::Outcome(const std::string& id, std::uint64_t change) const {
  const InstanceEntry* instance = state_.FindInstance(id);
  const auto gone = absl::AbortedError(absl::StrCat("id: ", OneLine(id, kMaxNameBytes), " does not run any more"));
  if (instance == nullptr || !WantsWorkers(instance->record.state())) return gone;
  const auto pending = pending_.find(instance->number);
  if (pending == pending_.end()) return gone;
  for (const Pending& entry : pending->second) {
    if (entry.change.number() == change) return entry.outcome;
  }
  return gone;
}

void PropertyChanges::Remove(InstanceEntry& instance, std::uint64_t change) {
  const auto is = [change](const Pending& entry) { return entry.change.number() == change; };
  if (std::erase_if(pending_[instance.number], is) > 0) state_.MarkOrders(instance);
}

void PropertyChanges::TakeAnswers(const InstanceEntry& instance, const v1::WorkerReport& report) {
  const auto pending = pending_.find(instance.number);
  if (pending == pending_.end()) return;
  for (const v1::PropertyAnswer& answer : report.property_answers()) {
    for (Pending& entry : pending->second) {
      if (entry.change.number() != answer.number() || entry.outcome) continue;
      entry.outcome =
          answer.refused().empty()
              ? absl::OkStatus()
              : absl::FailedPreconditionError(absl::StrCat("property: ", OneLine(answer.refused(), kMaxReasonBytes)));
    }
  }
}

std::vector<v1::PropertyChange> PropertyChanges::Unanswered(const InstanceEntry& instance) const {
  std::vector<v1::PropertyChange> changes;
  const auto pending = pending_.find(instance.number);
  if (pending == pending_.end()) return changes;
  for (const Pending& entry : pending->second) {
    if (!entry.outcome) changes.push_back(entry.change);
  }
  return changes;
}

}  // namespace tessera::control
