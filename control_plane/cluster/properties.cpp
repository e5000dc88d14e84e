// Changes of bodies' properties: told to all workers of an instance until one answers.
#include <algorithm>

#include "absl/strings/str_cat.h"
#include "control_plane/cluster/cluster.h"
#include "control_plane/id_ranges.h"
#include "control_plane/orders.h"
#include "core/world/proto_math.h"

namespace tessera::control {
namespace {

// As far as can be told from here; what a body has already is known where it is.
absl::Status CheckChange(const records::Instance& record, const v1::SetPropertyRequest& request) {
  const BodyId body(request.body());
  const bool known =
      IsPlayerBody(body)
          ? std::any_of(record.players().begin(), record.players().end(),
                        [&](const auto& p) { return PlayerBodyId(PlayerNumber(p.number())) == body && !p.left(); })
          : std::any_of(record.bodies().begin(), record.bodies().end(), [&](const records::IdRange& range) {
              return range.first() <= request.body() && request.body() <= range.last();
            });
  if (!known) {
    return absl::NotFoundError(absl::StrCat("body: ", record.id(), " has no dynamic body ", request.body()));
  }
  std::vector<PropertyDef> defs;
  defs.reserve(static_cast<std::size_t>(record.properties_size()));
  for (const v1::Property& declared : record.properties()) {
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

absl::StatusOr<std::uint64_t> Cluster::SetProperty(const v1::SetPropertyRequest& request) {
  const auto found = FindRunning(request.id());
  if (!found.ok()) return found.status();
  InstanceEntry& instance = **found;
  if (absl::Status status = CheckChange(instance.record, request); !status.ok()) return status;
  if (instance.property_changes.size() >= kMaxPropertyChanges) {
    return absl::ResourceExhaustedError(
        absl::StrCat("id: ", instance.property_changes.size(), " changes of ", request.id(), " wait already"));
  }
  if (request.validate_only()) return 0;
  PropertyChangeEntry& entry = instance.property_changes.emplace_back();
  entry.change.set_number(NextRevision());
  entry.change.set_body(request.body());
  *entry.change.mutable_property() = request.property();
  const std::uint64_t number = entry.change.number();
  MarkOrders(instance);
  Changed(instance);
  return number;
}

std::optional<absl::Status> Cluster::PropertyOutcome(const std::string& id, std::uint64_t number) const {
  const InstanceEntry* instance = FindInstance(id);
  const auto gone = absl::AbortedError(absl::StrCat("id: ", OneLine(id, kMaxNameBytes), " does not run any more"));
  if (instance == nullptr || !WantsWorkers(instance->record.state())) return gone;
  for (const PropertyChangeEntry& entry : instance->property_changes) {
    if (entry.change.number() == number) return entry.outcome;
  }
  return gone;
}

void Cluster::ForgetProperty(const std::string& id, std::uint64_t number) {
  InstanceEntry* instance = FindInstance(id);
  if (instance == nullptr) return;
  const auto is = [number](const PropertyChangeEntry& entry) { return entry.change.number() == number; };
  if (std::erase_if(instance->property_changes, is) > 0) MarkOrders(*instance);
}

void Cluster::TakePropertyAnswers(InstanceEntry& instance, const v1::WorkerReport& report) {
  for (const v1::PropertyAnswer& answer : report.property_answers()) {
    for (PropertyChangeEntry& entry : instance.property_changes) {
      if (entry.change.number() != answer.number() || entry.outcome) continue;
      entry.outcome =
          answer.refused().empty()
              ? absl::OkStatus()
              : absl::FailedPreconditionError(absl::StrCat("property: ", OneLine(answer.refused(), kMaxReasonBytes)));
    }
  }
}

}  // namespace tessera::control
