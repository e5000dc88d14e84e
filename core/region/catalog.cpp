#include "core/region/catalog.h"

#include <algorithm>
#include <cassert>
#include <map>

namespace tessera::region {
namespace {

// Disjoint sets over body ids, each named by its lowest member.
class Sets {
 public:
  BodyId Find(BodyId id) {
    while (true) {
      BodyId& parent = parent_.try_emplace(id, id).first->second;
      if (parent == id) return id;
      parent = parent_.at(parent);  // halves the way for the next one
      id = parent;
    }
  }
  void Unite(BodyId a, BodyId b) {
    const BodyId root_a = Find(a), root_b = Find(b);
    parent_[std::max(root_a, root_b)] = std::min(root_a, root_b);
  }

 private:
  std::map<BodyId, BodyId> parent_;
};

}  // namespace

Catalog::Catalog(std::shared_ptr<const Scene> scene, bool game)
    : scene_(std::move(scene)),
      has_game_(game),
      has_joints_(!scene_->joints.empty() ||
                  std::ranges::any_of(scene_->prefabs, [](const Prefab& prefab) { return !prefab.joints.empty(); })) {
  for (std::size_t i = 0; i < scene_->bodies.size(); ++i) {
    const BodyId id = scene_->bodies[i].id;
    const bool goes_on = i > 0 && id.value() == scene_->bodies[i - 1].id.value() + 1;
    if (!goes_on) runs_.push_back({id, i, i});
    runs_.back().end = i + 1;
  }
  Sets sets;
  std::map<BodyId, Jointed> by_root;
  for (const JointDef& joint : scene_->joints) {
    if (Dynamic(joint.body_a) && Dynamic(joint.body_b)) sets.Unite(joint.body_a, joint.body_b);
  }
  for (const JointDef& joint : scene_->joints) {
    const BodyId member = Dynamic(joint.body_a) ? joint.body_a : joint.body_b;
    if (!Dynamic(member)) continue;
    Jointed& assembly = by_root[sets.Find(member)];
    assembly.joints.push_back(&joint);
    for (const BodyId id : {joint.body_a, joint.body_b}) {
      if (Dynamic(id)) assembly.bodies.push_back(id);
    }
  }
  for (auto& [root, assembly] : by_root) {
    std::sort(assembly.bodies.begin(), assembly.bodies.end());
    assembly.bodies.erase(std::unique(assembly.bodies.begin(), assembly.bodies.end()), assembly.bodies.end());
    for (const BodyId id : assembly.bodies) assembly_of_[id] = assemblies_.size();
    assemblies_.push_back(std::move(assembly));
  }
}

bool Catalog::Dynamic(BodyId id) const {
  const BodyDef* def = Find(id);
  return def != nullptr && def->motion == Motion::kDynamic;
}

bool Catalog::Known(BodyId id) const {
  if (IsPlayerBody(id)) return scene_->player.has_value();
  if (id == kInstanceBody) return has_game_;
  return Dynamic(id);
}

const BodyDef* Catalog::Find(BodyId id) const {
  if (IsSpawned(id)) return PrefabBodyOf(*scene_, id);
  const auto after = std::upper_bound(runs_.begin(), runs_.end(), id,
                                      [](BodyId wanted, const IdRun& run) { return wanted < run.first; });
  if (after == runs_.begin()) return nullptr;
  const IdRun& run = *(after - 1);
  const std::uint64_t place = id.value() - run.first.value();
  return place < run.end - run.begin ? &scene_->bodies[run.begin + place] : nullptr;
}

double Catalog::MassOf(BodyId id) const {
  assert(Known(id));
  return IsPlayerBody(id) ? scene_->player->body.mass_kg : Find(id)->mass_kg;
}

// Maps cut a world into equal parts: few of them have a border here.
Vec3d Catalog::InstancePlace() const {
  constexpr double kX = 0.37, kY = 0.5, kZ = 0.41;
  const Vec3d size = scene_->bounds.max - scene_->bounds.min;
  return scene_->bounds.min + Vec3d{kX * size.x, kY * size.y, kZ * size.z};
}

BodyDef Catalog::MakePlayer(PlayerNumber player) const {
  assert(scene_->player.has_value());
  BodyDef def = scene_->player->body;
  def.id = PlayerBodyId(player);
  const std::vector<Vec3d>& points = scene_->player->spawn_points;
  if (!points.empty()) def.initial.position = points[(player.value() - 1) % points.size()];
  return def;
}

Assembly Catalog::AssemblyOf(BodyId id) const {
  if (IsSpawned(id) && Find(id) != nullptr) {
    return {WithMember(id, 0), scene_->prefabs[PartsOf(id).prefab].bodies.size()};
  }
  const auto it = assembly_of_.find(id);
  return it == assembly_of_.end() ? Assembly(id, 1) : Assembly(assemblies_[it->second].bodies);
}

void Catalog::ForEachJoint(BodyId id, absl::FunctionRef<void(const JointDef&)> visit) const {
  if (IsSpawned(id)) {
    for (const JointDef& joint : SpawnedJoints(*scene_, id)) visit(joint);
    return;
  }
  const auto it = assembly_of_.find(id);
  if (it == assembly_of_.end()) return;
  for (const JointDef* joint : assemblies_[it->second].joints) visit(*joint);
}

}  // namespace tessera::region
