// The joints of a region's bodies: those of the scene, and those that the game has made.
#include <algorithm>
#include <utility>

#include "core/region/bodies.h"

namespace tessera::region {

void Bodies::ConnectJoints() {
  std::vector<BodyId> assemblies = std::exchange(unconnected_, {});
  for (BodyId& id : assemblies) id = catalog_.AssemblyOf(id).front();
  std::ranges::sort(assemblies);
  assemblies.erase(std::unique(assemblies.begin(), assemblies.end()), assemblies.end());
  std::vector<JointDef> joints;
  for (const BodyId id : assemblies) {
    catalog_.ForEachJoint(id, [&](const JointDef& joint) {
      const bool a_here = world_.Has(joint.body_a);
      const bool b_here = joint.body_b == BodyId() || world_.Has(joint.body_b);
      if (a_here && b_here && !world_.HasJoint(joint.id)) joints.push_back(joint);
    });
  }
  std::ranges::sort(joints, {}, &JointDef::id);
  for (const JointDef& joint : joints) world_.AddJoint(joint);
}

void Bodies::SetGameJoints(std::vector<JointDef> joints) {
  if (joints.empty() && game_joints_.empty()) return;
  for (const JointDef& joint : game_joints_) {
    if (!std::ranges::binary_search(joints, joint.id, {}, &JointDef::id) && world_.HasJoint(joint.id)) {
      world_.RemoveJoint(joint.id);
    }
  }
  for (const JointDef& joint : joints) {
    if (world_.HasJoint(joint.id) || world_.IsParked(joint.body_a) || world_.IsParked(joint.body_b)) continue;
    world_.AddJoint(joint);
  }
  const bool same = std::ranges::equal(joints, game_joints_, {}, &JointDef::id, &JointDef::id);
  game_joints_ = std::move(joints);
  if (!same) FindGameAssemblies();
}

void Bodies::FindGameAssemblies() {
  assemblies_.clear();
  game_assembly_of_.clear();
  const auto assembly_of = [&](BodyId id) {
    const auto known = game_assembly_of_.find(id);
    if (known != game_assembly_of_.end()) return known->second;
    std::vector<BodyId>& members = assemblies_.emplace_back();
    for (const BodyId member : catalog_.AssemblyOf(id)) members.push_back(member);
    for (const BodyId member : members) game_assembly_of_[member] = assemblies_.size() - 1;
    return assemblies_.size() - 1;
  };
  for (const JointDef& joint : game_joints_) {
    const std::size_t into = assembly_of(joint.body_a), from = assembly_of(joint.body_b);
    if (into == from) continue;
    for (const BodyId member : assemblies_[from]) game_assembly_of_[member] = into;
    assemblies_[into].insert(assemblies_[into].end(), assemblies_[from].begin(), assemblies_[from].end());
    assemblies_[from].clear();
  }
  for (std::vector<BodyId>& members : assemblies_) std::ranges::sort(members);
}

Assembly Bodies::AssemblyOf(BodyId id) const {
  if (game_assembly_of_.empty()) return catalog_.AssemblyOf(id);
  const auto found = game_assembly_of_.find(id);
  return found == game_assembly_of_.end() ? catalog_.AssemblyOf(id) : Assembly(assemblies_[found->second]);
}

}  // namespace tessera::region
