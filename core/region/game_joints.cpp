#include "core/region/game_joints.h"

#include <algorithm>
#include <utility>

namespace tessera::region {
namespace {

// Players on their way to bodies that a neighbour owns.
void AddDrivers(const RecordTable& records, const Bodies& bodies, std::vector<Summons>& summoned) {
  const std::size_t before = summoned.size();
  for (const BodyId id : records.steering()) {
    if (!IsPlayerBody(id) || bodies.IndexOf(id) < 0) continue;
    const game::PlayerRecord& player = *records.Find(id)->game.player;
    if (player.stage != game::PlayerStage::kDriving || player.controls_until == Tick()) continue;
    const Ghost* other = bodies.FindGhost(player.controls);
    if (other != nullptr && !other->just_granted) summoned.push_back({id, other->owner});
  }
  if (summoned.size() > before) std::ranges::stable_sort(summoned, {}, &Summons::body);
}

}  // namespace

void ConnectGameJoints(const RecordTable& records, Bodies& bodies) {
  std::vector<JointDef> joints;
  for (const BodyId id : records.jointed()) {
    if (bodies.IndexOf(id) < 0) continue;
    for (const game::GameJoint& joint : records.Find(id)->game.joints) {
      if (bodies.IndexOf(joint.other) >= 0) joints.push_back(game::DefinitionOf(joint, id));
    }
  }
  for (const Ghost& ghost : bodies.ghosts()) {
    for (const game::GameJoint& joint : ghost.record.joints) {
      const Ghost* other = bodies.FindGhost(joint.other);
      if (other != nullptr && other->owner == ghost.owner) {
        joints.push_back(game::DefinitionOf(joint, ghost.record.id));
      }
    }
  }
  std::ranges::sort(joints, {}, &JointDef::id);
  // Only one of two neighbours that name the same joint can be right.
  const auto same = [](const JointDef& a, const JointDef& b) { return a.id == b.id; };
  joints.erase(std::unique(joints.begin(), joints.end(), same), joints.end());
  bodies.SetGameJoints(std::move(joints));
}

std::vector<Summons> FindSummoned(const RecordTable& records, const Bodies& bodies) {
  std::vector<Summons> summoned;
  for (const BodyId id : records.jointed()) {
    if (bodies.IndexOf(id) < 0) continue;
    for (const game::GameJoint& joint : records.Find(id)->game.joints) {
      const Ghost* other = bodies.FindGhost(joint.other);
      if (other == nullptr || other->just_granted) continue;
      summoned.push_back({id, other->owner});
      break;
    }
  }
  AddDrivers(records, bodies, summoned);
  return summoned;
}

}  // namespace tessera::region
