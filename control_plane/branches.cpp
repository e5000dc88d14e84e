#include "control_plane/branches.h"

#include <algorithm>
#include <map>

namespace tessera::control {
namespace {

// The branch of this number, as the record or one of its checkpoints has it; null: nothing of it is left.
const v1::Branch* BranchOf(const records::Instance& record, std::uint32_t number) {
  if (record.branch().number() == number) return &record.branch();
  for (const v1::Checkpoint& checkpoint : record.checkpoints()) {
    if (checkpoint.branch().number() == number) return &checkpoint.branch();
  }
  return nullptr;
}

}  // namespace

void BeginBranch(const records::Manifest& manifest, records::Instance& next) {
  std::map<std::uint32_t, std::uint64_t> last_ticks;  // for each branch on the way here
  v1::Branch from = manifest.branch();
  std::uint64_t tick = manifest.tick();
  // The first branch has number 0 and no parent.
  while (last_ticks.emplace(from.number(), tick).second && from.number() != 0) {
    tick = from.parent_tick();
    const v1::Branch* parent = BranchOf(next, from.parent());
    const std::uint32_t number = from.parent();
    from = parent == nullptr ? v1::Branch() : *parent;
    from.set_number(number);
    if (parent == nullptr) from.set_parent(number);  // which ends the way
  }
  for (v1::Checkpoint& checkpoint : *next.mutable_checkpoints()) {
    const auto last = last_ticks.find(checkpoint.branch().number());
    checkpoint.set_taken_back(last == last_ticks.end() || checkpoint.tick() > last->second);
  }
  v1::Branch& begun = *next.mutable_branch();
  begun.set_number(std::max(begun.number(), manifest.branch().number()) + 1);
  begun.set_parent(manifest.branch().number());
  begun.set_parent_tick(manifest.tick());
}

const v1::Checkpoint* NewestKept(const Checkpoints& checkpoints) { return NewestKeptBefore(checkpoints, 0); }

const v1::Checkpoint* NewestKeptBefore(const Checkpoints& checkpoints, std::uint64_t tick) {
  const auto kept = std::find_if(checkpoints.rbegin(), checkpoints.rend(), [tick](const v1::Checkpoint& c) {
    return !c.taken_back() && (tick == 0 || c.tick() < tick);
  });
  return kept == checkpoints.rend() ? nullptr : &*kept;
}

const v1::Checkpoint* KeptOf(const Checkpoints& checkpoints, std::uint64_t tick) {
  const auto kept = std::find_if(checkpoints.begin(), checkpoints.end(),
                                 [tick](const v1::Checkpoint& c) { return c.tick() == tick && !c.taken_back(); });
  return kept == checkpoints.end() ? nullptr : &*kept;
}

int FirstToGo(const Checkpoints& checkpoints) {
  const auto taken_back =
      std::find_if(checkpoints.begin(), checkpoints.end(), [](const v1::Checkpoint& c) { return c.taken_back(); });
  return taken_back == checkpoints.end() ? 0 : static_cast<int>(taken_back - checkpoints.begin());
}

}  // namespace tessera::control
