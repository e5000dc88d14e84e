#include "core/game/transaction.h"

namespace tessera::game {

Transaction::Changes* Transaction::Own(BodyId id) {
  if (const auto found = changes_.find(id); found != changes_.end()) return &found->second;
  if (!world_.Owns(id)) return nullptr;
  return &changes_.emplace(id, Changes{world_.ChangedOf(id), world_.RecordOf(id)}).first->second;
}

PropertySet Transaction::PropertiesOf(BodyId id) const {
  const auto found = changes_.find(id);
  return found == changes_.end() ? world_.ChangedOf(id) : found->second.properties;
}

void Transaction::Commit() {
  for (const auto& [id, changes] : changes_) world_.Commit(id, changes.properties, changes.record);
  changes_.clear();
}

}  // namespace tessera::game
