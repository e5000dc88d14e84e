#include "core/physics/waking.h"

namespace tessera::physics {
namespace {

void AddJointed(const RigidBody& body, std::vector<RigidBody*>* others) {
  for (const Joint* joint : body.joints) {
    others->push_back(joint->a);
    if (joint->b != nullptr) others->push_back(joint->b);
  }
}

}  // namespace

void Waking::Activate(RigidBody& body) {
  bodies_.ListAwake(body);
  pairs_.Activate(body);
}

void Waking::Wake(RigidBody& body) {
  waking_.assign(1, &body);
  while (!waking_.empty()) {
    RigidBody& next = *waking_.back();
    waking_.pop_back();
    if (!next.dynamic() || next.awake() || next.isolated) continue;
    next.Wake();
    Activate(next);
    AddJointed(next, &waking_);
  }
}

// Nobody has searched a pair that came into the world asleep, so its bounds have to do.
void Waking::WakeNeighbours(const RigidBody& body) {
  neighbours_.clear();
  for (const auto& [pair, other] : body.pairs) {
    const bool may_touch = pair->searched ? pair->touching : pair->low->reach.Overlaps(pair->high->reach);
    if (may_touch && !pair->trigger) neighbours_.push_back(other);
  }
  AddJointed(body, &neighbours_);
  for (RigidBody* other : neighbours_) {
    if (other != &body) Wake(*other);
  }
}

}  // namespace tessera::physics
