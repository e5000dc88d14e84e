#include <algorithm>
#include <unordered_map>

#include "absl/strings/str_cat.h"
#include "core/world/faults.h"
#include "core/world/limits.h"
#include "core/world/proto_math.h"
#include "core/world/resolve_body.h"
#include "core/world/resolve_character.h"
#include "core/world/resolve_field.h"
#include "core/world/resolve_joint.h"
#include "core/world/resolve_layers.h"
#include "core/world/resolve_prefab.h"
#include "core/world/scatter.h"
#include "core/world/scene_io.h"

namespace tessera {
namespace {

// The part of its weight that a player's body may lift unless the scene says more: a push up makes it lighter, and
// never lets it rise.
constexpr double kDefaultLift = 0.5;

// Builds one scene. The steps stand in the order in which they need each other; each adds to `faults_` and goes on, so
// that all faults are counted.
class SceneResolver {
 public:
  SceneResolver(const v1::Scene& in, std::string_view file) : in_(in), faults_(std::string(file)) {}

  absl::StatusOr<std::shared_ptr<const Scene>> Resolve();

 private:
  void ResolveGlobals();
  bool CheckCounts();
  void ResolveBodies(BodyResolver& bodies);
  void ResolveScatters(BodyResolver& bodies);
  bool CheckScatterGrid(const v1::Scatter& in);
  void CheckScatterIds(const std::vector<int>& usable);
  void ResolveJoints();
  void CheckJointEnds(const v1::Joint& joint);
  const BodyDef* Find(std::uint64_t id) const;
  void ResolvePlayer(BodyResolver& bodies);
  void ResolveForce(const v1::PlayerRules& in, PlayerRules& out);
  void ResolveTeams();
  void ResolveView();
  // Declarations of a list of this name.
  void ResolveProperties(const google::protobuf::RepeatedPtrField<v1::Property>& list, const char* name,
                         std::vector<PropertyDef>& out);

  const v1::Scene& in_;
  Faults faults_;
  std::shared_ptr<Scene> out_ = std::make_shared<Scene>();
  std::unordered_map<std::uint64_t, int> index_of_;  // body id -> place in in_.bodies()
};

absl::StatusOr<std::shared_ptr<const Scene>> SceneResolver::Resolve() {
  ResolveGlobals();
  // A scene that is too big is not examined any further.
  if (!CheckCounts()) return faults_.ToStatus();
  ResolveProperties(in_.properties(), "properties", out_->properties);
  ResolveProperties(in_.instance_properties(), "instance_properties", out_->instance_properties);
  ResolveTeams();
  const std::vector<CollisionLayer> layers = ResolveLayers(faults_, in_, &out_->layers);
  BodyResolver bodies(faults_, out_->bounds, out_->gravity_m_s2, out_->properties, {out_->layers, layers});
  for (int i = 0; i < in_.materials_size(); ++i) bodies.AddMaterial(i, in_.materials(i));
  ResolveBodies(bodies);
  ResolveScatters(bodies);
  std::ranges::sort(out_->bodies, {}, &BodyDef::id);
  ResolveJoints();
  out_->fields = ResolveFields(faults_, in_, out_->tick_rate_hz);
  ResolvePlayer(bodies);
  out_->prefabs = ResolvePrefabs(faults_, bodies, in_);
  out_->kinds = bodies.kinds();
  ResolveView();
  if (faults_.count() > 0) return faults_.ToStatus();
  return out_;
}

void SceneResolver::ResolveGlobals() {
  faults_.At("");
  const auto allowed = [](char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-'; };
  if (faults_.Name("name", in_.name()) && (in_.name().empty() || !std::ranges::all_of(in_.name(), allowed))) {
    faults_.Add(absl::StrCat("name must be of lower case letters, digits and dashes, got \"", in_.name(), "\""));
  }
  out_->name = in_.name();
  faults_.Volume("bounds", in_.bounds());
  out_->bounds = FromProto(in_.bounds());
  if (in_.has_gravity()) {
    faults_.Length("gravity", in_.gravity(), kMaxAcceleration_m_s2);
    out_->gravity_m_s2 = FromProto(in_.gravity());
  }
  if (in_.tick_rate_hz() != 0) {
    faults_.Range("tick_rate_hz", in_.tick_rate_hz(), kMinTickRateHz, kMaxTickRateHz);
    out_->tick_rate_hz = in_.tick_rate_hz();
  }
}

bool SceneResolver::CheckCounts() {
  std::uint64_t bodies = static_cast<std::uint64_t>(in_.bodies_size());
  for (const v1::Scatter& scatter : in_.scatters()) bodies += scatter.count();
  const auto most = [this](const char* field, std::uint64_t count, std::uint64_t limit) {
    if (count <= limit) return true;
    faults_.Add(absl::StrCat(field, " must be at most ", limit, ", got ", count));
    return false;
  };
  const bool fits = most("bodies, scattered ones included,", bodies, kMaxBodies);
  const bool joints = most("joints", static_cast<std::uint64_t>(in_.joints_size()), kMaxJoints);
  if (!most("fields", static_cast<std::uint64_t>(in_.fields_size()), kMaxFields) || !joints || !fits) return false;
  if (bodies == 0 && !in_.has_player()) faults_.Add("the scene is empty: it has no bodies and no player");
  out_->bodies.reserve(bodies);
  return true;
}

void SceneResolver::ResolveBodies(BodyResolver& bodies) {
  for (int i = 0; i < in_.bodies_size(); ++i) {
    const v1::Body& body = in_.bodies(i);
    out_->bodies.push_back(bodies.Body(i, body));
    const auto [first, added] = index_of_.emplace(body.id(), i);
    if (!added && body.id() != 0) {
      faults_.Add(
          absl::StrCat("id ", body.id(), " is also that of ", PlaceOf(first->second, in_.bodies(first->second))));
    }
  }
}

// Checks the grid and the places of its bodies; ids are checked for all scatters together.
bool SceneResolver::CheckScatterGrid(const v1::Scatter& in) {
  const std::size_t before = faults_.count();
  if (in.count() == 0) faults_.Add("count must be > 0, got 0");
  if (in.templates().empty()) faults_.Add("templates is empty: give at least one body");
  if (in.first_id() < 1 || in.first_id() > kMaxSceneBody || in.count() > kMaxSceneBody - in.first_id() + 1) {
    faults_.Add(absl::StrCat("first_id must be 1 to ", kMaxSceneBody, " with room for count = ", in.count(), ", got ",
                             in.first_id()));
  }
  const bool spacing = faults_.Positive("spacing", in.spacing(), kMinExtent_m, kMaxExtent_m);
  if (!faults_.Volume("area", in.area()) || !spacing) return false;
  faults_.Range("jitter", in.jitter(), 0, in.spacing() / 2);
  const Aabb area = FromProto(in.area());
  if (!out_->bounds.Contains(area.min) || !out_->bounds.Contains(area.max)) {
    faults_.Add("area is not inside the scene's bounds");
  }
  if (area.max.x - area.min.x < in.spacing() || area.max.z - area.min.z < in.spacing()) {
    faults_.Add(absl::StrCat("area must be at least one spacing, ", in.spacing(), " m, wide in x and z"));
  }
  if (faults_.count() != before) return false;
  const ScatterGrid grid{.area = area, .spacing_m = in.spacing(), .jitter_m = in.jitter(), .seed = in.seed()};
  if (const double top = grid.TopOf(in.count()); top > out_->bounds.max.y) {
    faults_.Add(absl::StrCat("count = ", in.count(), " needs layers up to ", top,
                             " m, above the scene's bounds.max.y = ", out_->bounds.max.y));
  }
  return faults_.count() == before;
}

void SceneResolver::ResolveScatters(BodyResolver& bodies) {
  std::vector<int> usable;
  for (int s = 0; s < in_.scatters_size(); ++s) {
    const v1::Scatter& in = in_.scatters(s);
    const std::string place = absl::StrCat("scatters[", s, "]");
    std::vector<BodyDef> templates;
    templates.reserve(static_cast<std::size_t>(in.templates_size()));
    for (int t = 0; t < in.templates_size(); ++t) {
      templates.push_back(bodies.Template(absl::StrCat(place, ".templates[", t, "]"), in.templates(t)));
    }
    faults_.At(place);
    if (!CheckScatterGrid(in)) continue;
    usable.push_back(s);
    const ScatterGrid grid{
        .area = FromProto(in.area()), .spacing_m = in.spacing(), .jitter_m = in.jitter(), .seed = in.seed()};
    ForEachScattered(grid, in.count(), [&](std::uint32_t i, Vec3d position) {
      BodyDef& body = out_->bodies.emplace_back(templates[i % templates.size()]);
      body.id = BodyId(in.first_id() + i);
      body.initial.position = position;
    });
  }
  CheckScatterIds(usable);
}

void SceneResolver::CheckScatterIds(const std::vector<int>& usable) {
  std::vector<int> by_first = usable;
  std::ranges::stable_sort(by_first, {}, [&](int s) { return in_.scatters(s).first_id(); });
  const auto end = [&](int s) { return in_.scatters(s).first_id() + in_.scatters(s).count(); };
  for (std::size_t i = 1; i < by_first.size(); ++i) {
    const int before = by_first[i - 1], s = by_first[i];
    if (in_.scatters(s).first_id() >= end(before)) continue;
    faults_.At(absl::StrCat("scatters[", s, "]"));
    faults_.Add(absl::StrCat("first_id ", in_.scatters(s).first_id(), " is among the ids of scatters[", before, "], ",
                             in_.scatters(before).first_id(), " to ", end(before) - 1));
  }
  for (int b = 0; b < in_.bodies_size(); ++b) {
    const std::uint64_t id = in_.bodies(b).id();
    const auto after = std::ranges::upper_bound(by_first, id, {}, [&](int s) { return in_.scatters(s).first_id(); });
    if (after == by_first.begin() || id >= end(*(after - 1))) continue;
    faults_.At(PlaceOf(b, in_.bodies(b)));
    faults_.Add(absl::StrCat("id ", id, " is among the ids of scatters[", *(after - 1), "], ",
                             in_.scatters(*(after - 1)).first_id(), " to ", end(*(after - 1)) - 1));
  }
}

// Null if there is no such body. Bodies are sorted by now.
const BodyDef* SceneResolver::Find(std::uint64_t id) const {
  const auto it = std::ranges::lower_bound(out_->bodies, BodyId(id), {}, &BodyDef::id);
  return it != out_->bodies.end() && it->id == BodyId(id) ? &*it : nullptr;
}

void SceneResolver::CheckJointEnds(const v1::Joint& joint) {
  const BodyDef* a = Find(joint.body_a());
  const BodyDef* b = joint.body_b() == 0 ? nullptr : Find(joint.body_b());
  if (joint.body_a() == 0) return faults_.Add("body_a is missing");
  if (a == nullptr) faults_.Add(absl::StrCat("body_a: there is no body ", joint.body_a()));
  if (joint.body_b() != 0 && b == nullptr) faults_.Add(absl::StrCat("body_b: there is no body ", joint.body_b()));
  if (joint.body_a() == joint.body_b()) faults_.Add(absl::StrCat("ties body ", joint.body_a(), " to itself"));
  if (a == nullptr || (joint.body_b() != 0 && b == nullptr) || a == b) return;
  if (a->motion == Motion::kStatic && (b == nullptr || b->motion == Motion::kStatic)) {
    faults_.Add(b == nullptr ? absl::StrCat("ties static body ", joint.body_a(), " to the world")
                             : absl::StrCat("ties two static bodies, ", joint.body_a(), " and ", joint.body_b()));
  }
}

void SceneResolver::ResolveJoints() {
  std::unordered_map<std::uint32_t, int> index_of;
  for (int i = 0; i < in_.joints_size(); ++i) {
    const v1::Joint& joint = in_.joints(i);
    faults_.At(absl::StrCat("joints[", i, "] (id ", joint.id(), ")"));
    if (joint.id() == 0) faults_.Add("id must be > 0, got 0");
    const auto [first, added] = index_of.emplace(joint.id(), i);
    if (!added && joint.id() != 0) {
      faults_.Add(absl::StrCat("id ", joint.id(), " is also that of joints[", first->second, "]"));
    }
    CheckJointEnds(joint);
    out_->joints.push_back(ResolveJoint(faults_, joint));
  }
  std::ranges::sort(out_->joints, {}, &JointDef::id);
}

void SceneResolver::ResolvePlayer(BodyResolver& bodies) {
  if (!in_.has_player()) return;
  const v1::PlayerRules& in = in_.player();
  PlayerRules& out = out_->player.emplace();
  out.body = bodies.Template("player.body", in.body());
  if (out.body.motion == Motion::kStatic) faults_.Add("motion must be MOTION_DYNAMIC");
  faults_.At("player");
  if (in.spawn_points().empty()) faults_.Add("spawn_points is empty: give at least one");
  for (int i = 0; i < in.spawn_points_size(); ++i) {
    const std::string field = absl::StrCat("spawn_points[", i, "]");
    if (!faults_.Vector(field, in.spawn_points(i), kMaxCoordinate_m)) continue;
    out.spawn_points.push_back(FromProto(in.spawn_points(i)));
    if (!out_->bounds.Contains(out.spawn_points.back())) faults_.Add(field + " is outside the scene's bounds");
  }
  if (in.has_character()) {
    out.character = ResolveCharacter(faults_, in, out_->gravity_m_s2, out.body);
  } else {
    ResolveForce(in, out);
  }
}

void SceneResolver::ResolveForce(const v1::PlayerRules& in, PlayerRules& out) {
  const double most_force = kMaxAcceleration_m_s2 * out.body.mass_kg;
  if (faults_.NotNegative("max_force", in.max_force(), kMaxForce) && most_force > 0 && in.max_force() > most_force) {
    faults_.Add(absl::StrCat("max_force must be at most ", kMaxAcceleration_m_s2, " m/s^2 times the body's mass, ",
                             most_force, ", got ", in.max_force()));
  }
  faults_.Positive("max_speed", in.max_speed(), 1e-3, kMaxSpeed_m_s);
  out.max_force_n = in.max_force();
  out.max_speed_m_s = in.max_speed();
  const Vec3d weight_n = out_->gravity_m_s2 * (out.body.gravity_scale * out.body.mass_kg);
  out.up = Normalized(-weight_n);
  if (in.has_max_force_up()) {
    if (faults_.NotNegative("max_force_up", in.max_force_up(), kMaxForce)) out.max_force_up_n = in.max_force_up();
  } else if (weight_n != Vec3d()) {
    out.max_force_up_n = kDefaultLift * Length(weight_n);
  }
}

void SceneResolver::ResolveProperties(const google::protobuf::RepeatedPtrField<v1::Property>& list, const char* name,
                                      std::vector<PropertyDef>& out) {
  faults_.At("");
  if (static_cast<std::size_t>(list.size()) > kMaxProperties) {
    return faults_.Add(absl::StrCat(name, ": at most ", kMaxProperties, ", got ", list.size()));
  }
  std::unordered_map<std::string, int> index_of;
  for (int i = 0; i < list.size(); ++i) {
    const v1::Property& in = list[i];
    faults_.At(absl::StrCat(name, "[", i, "]"));
    if (in.name().empty()) faults_.Add("name is missing");
    faults_.Name("name", in.name());
    const auto [first, added] = index_of.emplace(in.name(), i);
    if (!added) faults_.Add(absl::StrCat("name is also that of ", name, "[", first->second, "]"));
    const std::optional<PropertyValue> value = FromProto(in);
    if (!value.has_value()) {
      faults_.Add("give flag, number, real, text, vector, body or bytes: it says the type");
      continue;
    }
    if (!v1::Visibility_IsValid(in.visible_to())) faults_.Add(absl::StrCat("visible_to: unknown, ", in.visible_to()));
    out.push_back({in.name(), *value, FromProto(in.visible_to())});
    PropertySet alone;
    if (const absl::Status status = alone.Set({&out.back(), 1}, in.name(), *value); !status.ok()) {
      faults_.Add(absl::StrCat(ValueField(in), ": ", status.message()));
    }
  }
}

void SceneResolver::ResolveTeams() {
  faults_.At("team_property");
  out_->team_property = in_.team_property();
  const auto tells_teams = [&](const PropertyDef& def) {
    const bool named =
        std::holds_alternative<std::string>(def.initial) || std::holds_alternative<std::int64_t>(def.initial);
    return named && def.name == out_->team_property;
  };
  if (!out_->team_property.empty() && std::ranges::none_of(out_->properties, tells_teams)) {
    faults_.Add("is no property that is a text or a number");
  }
  const auto of_team = [](const PropertyDef& def) { return def.visible_to == Visibility::kTeam; };
  if (out_->team_property.empty() && std::ranges::any_of(out_->properties, of_team)) {
    faults_.Add("is missing: a property is for teams");
  }
  if (std::ranges::any_of(out_->instance_properties, of_team)) faults_.Add("the world is in no team");
}

void SceneResolver::ResolveView() {
  faults_.At("view");
  if (faults_.NotNegative("radius", in_.view().radius(), kMaxCoordinate_m)) out_->view.radius_m = in_.view().radius();
  if (in_.view().bytes_per_second() == 0) return;
  if (faults_.Positive("bytes_per_second", in_.view().bytes_per_second(), kMinViewBytes_per_s, kMaxViewBytes_per_s)) {
    out_->view.bytes_per_s = in_.view().bytes_per_second();
  }
}

}  // namespace

absl::StatusOr<std::shared_ptr<const Scene>> ResolveScene(const v1::Scene& scene, std::string_view file) {
  return SceneResolver(scene, file).Resolve();
}

}  // namespace tessera
