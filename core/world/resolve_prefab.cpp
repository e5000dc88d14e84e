#include "core/world/resolve_prefab.h"

#include <algorithm>
#include <string>
#include <unordered_map>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "core/world/resolve_joint.h"
#include "core/world/spawned_id.h"

namespace tessera {
namespace {

bool IsName(const std::string& name) {
  return !name.empty() && std::ranges::all_of(name, [](unsigned char c) { return absl::ascii_isalnum(c) || c == '_'; });
}

// Whether the joints leave no body apart.
bool ConnectsAll(const Prefab& prefab) {
  std::vector<bool> reached(prefab.bodies.size(), false);
  reached[0] = true;
  for (std::size_t round = 0; round < prefab.bodies.size(); ++round) {
    for (const JointDef& joint : prefab.joints) {
      const std::size_t a = joint.body_a.value() - 1, b = joint.body_b.value() - 1;
      if (reached[a] || reached[b]) reached[a] = reached[b] = true;
    }
  }
  return std::ranges::all_of(reached, [](bool one) { return one; });
}

class PrefabResolver {
 public:
  PrefabResolver(Faults& faults, BodyResolver& bodies, std::string place)
      : faults_(faults), bodies_(bodies), place_(std::move(place)) {}

  Prefab Resolve(const v1::Prefab& in) {
    const std::size_t before = faults_.count();
    Prefab out;
    out.name = in.name();
    const auto count = static_cast<std::uint64_t>(in.bodies_size());
    if (count < 1 || count > kMaxPrefabBodies) {
      faults_.Add(absl::StrCat("bodies: 1 to ", kMaxPrefabBodies, " are needed, got ", count));
      return out;
    }
    for (int i = 0; i < in.bodies_size(); ++i) {
      out.bodies.push_back(bodies_.Member(absl::StrCat(place_, ".bodies[", i, "]"), in.bodies(i)));
      out.bodies.back().id = BodyId(static_cast<std::uint64_t>(i) + 1);
    }
    for (int i = 0; i < in.joints_size(); ++i) AddJoint(i, in.joints(i), out);
    faults_.At(place_);
    // Joint ids have as much room as those of bodies.
    if (out.joints.size() > kMaxPrefabBodies) {
      faults_.Add(absl::StrCat("joints: at most ", kMaxPrefabBodies, ", got ", out.joints.size()));
    }
    if (faults_.count() == before && !ConnectsAll(out)) faults_.Add("joints: they do not connect all of its bodies");
    return out;
  }

 private:
  void AddJoint(int index, const v1::Joint& in, Prefab& out) {
    faults_.At(absl::StrCat(place_, ".joints[", index, "]"));
    if (in.id() != 0) faults_.Add(absl::StrCat("id must be left out of a prefab, got ", in.id()));
    const auto check_end = [&](const char* field, std::uint64_t body) {
      if (body >= 1 && body <= out.bodies.size()) return;
      faults_.Add(absl::StrCat(field, " must be 1 to ", out.bodies.size(), ", a body of the prefab, got ", body));
    };
    check_end("body_a", in.body_a());
    check_end("body_b", in.body_b());
    if (in.body_a() == in.body_b()) faults_.Add(absl::StrCat("ties body ", in.body_a(), " to itself"));
    out.joints.push_back(ResolveJoint(faults_, in));
    out.joints.back().id = JointId(static_cast<std::uint64_t>(index) + 1);
  }

  Faults& faults_;
  BodyResolver& bodies_;
  const std::string place_;
};

}  // namespace

std::vector<Prefab> ResolvePrefabs(Faults& faults, BodyResolver& bodies, const v1::Scene& scene) {
  faults.At("");
  if (static_cast<std::uint64_t>(scene.prefabs_size()) > kMaxPrefabs) {
    faults.Add(absl::StrCat("prefabs: at most ", kMaxPrefabs, ", got ", scene.prefabs_size()));
    return {};
  }
  std::vector<Prefab> prefabs;
  std::unordered_map<std::string, int> index_of;
  for (int i = 0; i < scene.prefabs_size(); ++i) {
    const v1::Prefab& in = scene.prefabs(i);
    const std::string place = absl::StrCat("prefabs[", i, "]");
    faults.At(place);
    if (faults.Name("name", in.name()) && !IsName(in.name())) {
      faults.Add("name must be of 1 to 63 letters, digits and underscores");
    }
    const auto [first, added] = index_of.emplace(in.name(), i);
    if (!added) faults.Add(absl::StrCat("name is also that of prefabs[", first->second, "]"));
    prefabs.push_back(PrefabResolver(faults, bodies, place).Resolve(in));
  }
  return prefabs;
}

}  // namespace tessera
