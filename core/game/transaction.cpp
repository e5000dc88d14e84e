#include "core/game/transaction.h"

#include <cassert>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"

namespace tessera::game {

const BodyDef* Transaction::Find(BodyId id) const {
  if (const auto made = made_.find(id); made != made_.end()) return &made->second.def;
  return removed_.contains(id) ? nullptr : world_.Find(id);
}

BodyState Transaction::StateOf(BodyId id) const {
  const auto made = made_.find(id);
  return made != made_.end() ? made->second.state : world_.StateOf(id);
}

bool Transaction::Owns(BodyId id) const { return made_.contains(id) || (!removed_.contains(id) && world_.Owns(id)); }

PropertySet Transaction::PropertiesOf(BodyId id) const {
  const auto found = changes_.find(id);
  return found == changes_.end() ? world_.ChangedOf(id) : found->second.properties;
}

Transaction::Changes* Transaction::Own(BodyId id) {
  if (const auto found = changes_.find(id); found != changes_.end()) return &found->second;
  if (!Owns(id)) return nullptr;
  return &changes_.emplace(id, Changes{world_.ChangedOf(id), world_.RecordOf(id)}).first->second;
}

absl::StatusOr<BodyId> Transaction::Spawn(std::size_t prefab, const SpawnMotion& motion) {
  const Scene& scene = world_.scene();
  const std::size_t count = scene.prefabs[prefab].bodies.size();
  if (count > limits_.bodies) return absl::ResourceExhaustedError("more bodies than a region may make in a tick");
  const std::size_t bodies = world_.OwnedCount() + made_.size();
  if (bodies + count > limits_.in_region) {
    return absl::ResourceExhaustedError(
        absl::StrCat("the region has ", bodies, " bodies, of at most ", limits_.in_region));
  }
  const std::optional<BodyId> first = world_.NextId(prefab);
  if (!first) return absl::ResourceExhaustedError("the region has given all its ids");
  limits_.bodies -= count;
  for (std::size_t member = 0; member < count; ++member) {
    const BodyId id = WithMember(*first, member);
    const BodyDef& body = scene.prefabs[prefab].bodies[member];
    made_.emplace(id, Made{MakeSpawned(scene, id), SpawnedState(body, motion)});
    changes_.emplace(id, Changes{});
  }
  return *first;
}

void Transaction::Remove(BodyId id) {
  assert(Owns(id));
  changes_.erase(id);
  if (made_.erase(id) == 0) removed_.insert(id);
}

std::size_t Transaction::Commit() {
  for (const auto& [id, made] : made_) world_.Spawn(id, made.state);
  const bool together = changes_.size() + removed_.size() > 1;
  for (const auto& [id, changes] : changes_) world_.Commit(id, changes.properties, changes.record, together);
  for (const BodyId id : removed_) world_.Remove(id);
  changes_.clear();
  removed_.clear();
  return std::exchange(made_, {}).size();
}

}  // namespace tessera::game
