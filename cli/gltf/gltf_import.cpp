#include "cli/gltf/gltf_import.h"

#include <tiny_gltf.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <string_view>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "cli/gltf/gltf_geometry.h"
#include "cli/gltf/gltf_shapes.h"
#include "cli/gltf/gltf_textures.h"
#include "cli/gltf/gltf_transform.h"
#include "cli/gltf/gltf_values.h"
#include "cli/gltf/gltf_visuals.h"
#include "core/world/limits.h"
#include "core/world/proto_math.h"
#include "core/world/sha256.h"
#include "core/world/utf8.h"

namespace tessera::cli {
namespace {

constexpr char kBodyExtension[] = "OMI_physics_body";
// Free ground around a level, and room above and below it, m.
constexpr double kMargin_m = 10, kAbove_m = 50;
// A character stands with its middle so high above its spawn point.
constexpr double kSpawnHeight_m = 0.95;

absl::Status Fault(const std::string& what) { return absl::InvalidArgumentError(what); }

// The name of a node as the scene may have it.
std::string NameOf(const tinygltf::Node& node) {
  std::string name;
  for (const char c : node.name) name += static_cast<unsigned char>(c) < 0x20 || c == 0x7f ? '_' : c;
  while (name.size() > kMaxNameLength || !IsUtf8(name)) {
    if (name.empty()) break;
    name.pop_back();
  }
  return name;
}

absl::StatusOr<tinygltf::Model> Load(std::span<const std::uint8_t> bytes, const std::string& folder,
                                     Pictures& pictures) {
  tinygltf::Model model;
  tinygltf::TinyGLTF loader;
  loader.SetImageLoader(KeepPicture, &pictures);
  std::string error, warning;
  const bool binary = bytes.size() >= 4 && std::equal(bytes.begin(), bytes.begin() + 4, "glTF");
  bool loaded = false;
  try {
    const auto size = static_cast<unsigned>(bytes.size());
    loaded = binary ? loader.LoadBinaryFromMemory(&model, &error, &warning, bytes.data(), size, folder)
                    : loader.LoadASCIIFromString(&model, &error, &warning, reinterpret_cast<const char*>(bytes.data()),
                                                 size, folder);
  } catch (const std::exception& thrown) {
    error = thrown.what();
  }
  if (loaded) return model;
  std::string line = error.substr(0, error.find('\n'));
  return Fault(line.empty() ? "is no glTF 2.0 file" : line);
}

// Extensions without which the geometry would be another one.
absl::Status CheckRequired(const tinygltf::Model& model) {
  for (const std::string& extension : model.extensionsRequired) {
    const bool harmless = absl::StartsWith(extension, "KHR_materials_") ||
                          absl::StartsWith(extension, "KHR_texture_") || absl::StartsWith(extension, "KHR_lights_") ||
                          absl::StartsWith(extension, "EXT_texture_") || absl::StartsWith(extension, "OMI_");
    if (!harmless) {
      return Fault(absl::StrCat("needs the extension ", extension, ", which is not supported; export without it"));
    }
  }
  return absl::OkStatus();
}

Affine LocalMap(const tinygltf::Node& node) {
  Affine map;
  if (node.matrix.size() == 16) {
    const std::vector<double>& m = node.matrix;
    map.axes = {Vec3d{m[0], m[1], m[2]}, Vec3d{m[4], m[5], m[6]}, Vec3d{m[8], m[9], m[10]}};
    map.origin = {m[12], m[13], m[14]};
    return map;
  }
  if (node.rotation.size() == 4) {
    const Quatd turn = Normalized(Quatd{node.rotation[0], node.rotation[1], node.rotation[2], node.rotation[3]});
    for (Vec3d& axis : map.axes) axis = Rotate(turn, axis);
  }
  if (node.scale.size() == 3) {
    for (std::size_t i = 0; i < 3; ++i) map.axes[i] *= node.scale[i];
  }
  if (node.translation.size() == 3) map.origin = {node.translation[0], node.translation[1], node.translation[2]};
  return map;
}

// `map` as seen from a body at this pose.
Affine Seen(const Pose& from, const Affine& map) {
  const Quatd back = Conjugate(from.orientation);
  return {{Rotate(back, map.axes[0]), Rotate(back, map.axes[1]), Rotate(back, map.axes[2])},
          Rotate(back, map.origin - from.position)};
}

// Where a visual is whose mesh this map puts into its shape; nothing if it is sheared, flat or absurdly scaled.
std::optional<v1::Visual> PlacedVisual(const Affine& map) {
  const auto placed = Parts(map);
  if (!placed) return std::nullopt;
  Vec3d scale = placed->scale;
  for (const double part : {scale.x, scale.y, scale.z}) {
    if (part < kMinVisualScale || part > kMaxVisualScale) return std::nullopt;
  }
  for (const double part : {map.origin.x, map.origin.y, map.origin.z}) {
    if (std::abs(part) > kMaxExtent_m) return std::nullopt;
  }
  if (map.Determinant() < 0) scale.x = -scale.x;
  v1::Visual visual;
  if (placed->pose != Pose()) *visual.mutable_pose() = ToProto(placed->pose);
  if (scale != Vec3d{1, 1, 1}) *visual.mutable_scale() = ToProto(scale);
  return visual;
}

class Importer {
 public:
  Importer(const tinygltf::Model& model, const Pictures& pictures, const std::string& name)
      : model_(model), visuals_(model, pictures) {
    result_.scene.set_name(name);
  }

  absl::StatusOr<GltfImport> Run();

 private:
  // A mesh of the model, and the map of its node.
  struct DrawnMesh {
    int mesh = 0;
    Affine map;
  };
  // A body that parts of the level hang below.
  struct Body {
    std::string where;
    Affine map;  // map of its node
    Pose pose;
    v1::Body proto;
    std::vector<ShapePart> parts;
    std::vector<DrawnMesh> drawn;
  };
  struct Visit {
    int node = 0;
    Affine map;  // map of the parent
    int body = -1;
  };

  absl::Status Enter(const Visit& visit, std::vector<Visit>& next);
  absl::Status AddBody(const Visit& visit, const Affine& map, const tinygltf::Node& node,
                       const tinygltf::Value& motion);
  absl::Status AddShape(int body, const Affine& map, const tinygltf::Node& node, int shape, bool trigger);
  absl::Status AddMesh(const Affine& map, const tinygltf::Node& node, const std::string& where);
  absl::Status FinishBody(Body& body);
  absl::Status Place(const std::string& where, v1::Body body, const Pose& pose, const Aabb& box);
  void Draw(const std::vector<DrawnMesh>& drawn, const Pose& pose, v1::Shape& shape);
  void KeepVisuals();
  void NoteRest();
  void SetBounds();
  void Count(const std::string& what) { ++left_out_[what]; }
  std::string Where(int node) const {
    return absl::StrCat("node ", node, " \"", model_.nodes[static_cast<std::size_t>(node)].name, "\"");
  }

  const tinygltf::Model& model_;
  GltfImport result_;
  std::vector<Body> bodies_;
  std::vector<bool> seen_;
  std::map<std::string, std::size_t> left_out_;
  std::optional<Aabb> box_;
  std::map<int, Triangles> meshes_;
  VisualMeshes visuals_;
};

absl::StatusOr<GltfImport> Importer::Run() {
  if (absl::Status required = CheckRequired(model_); !required.ok()) return required;
  result_.nodes = model_.nodes.size();
  if (result_.nodes > kMaxGltfNodes) {
    return Fault(absl::StrCat("has ", result_.nodes, " nodes; at most ", kMaxGltfNodes, " are taken"));
  }
  if (model_.scenes.empty()) return Fault("has no scene");
  const int chosen = model_.defaultScene < 0 ? 0 : model_.defaultScene;
  if (static_cast<std::size_t>(chosen) >= model_.scenes.size()) return Fault(absl::StrCat("has no scene ", chosen));
  seen_.resize(result_.nodes);
  std::vector<Visit> open;
  const std::vector<int>& roots = model_.scenes[static_cast<std::size_t>(chosen)].nodes;
  for (auto root = roots.rbegin(); root != roots.rend(); ++root) open.push_back({*root, {}, -1});
  while (!open.empty()) {
    const Visit visit = open.back();
    open.pop_back();
    if (absl::Status entered = Enter(visit, open); !entered.ok()) return entered;
  }
  for (Body& body : bodies_) {
    if (absl::Status finished = FinishBody(body); !finished.ok()) return finished;
  }
  if (result_.scene.bodies().empty()) return Fault("has nothing that a body could be made of: no mesh, no shape");
  SetBounds();
  KeepVisuals();
  NoteRest();
  return std::move(result_);
}

absl::Status Importer::Enter(const Visit& visit, std::vector<Visit>& next) {
  if (visit.node < 0 || static_cast<std::size_t>(visit.node) >= model_.nodes.size()) {
    return Fault(absl::StrCat("nodes: there is no node ", visit.node));
  }
  const auto index = static_cast<std::size_t>(visit.node);
  const tinygltf::Node& node = model_.nodes[index];
  const std::string where = Where(visit.node);
  if (seen_[index]) return Fault(absl::StrCat(where, ": is below two nodes, or below itself"));
  seen_[index] = true;
  const Affine map = visit.map * LocalMap(node);
  for (const Vec3d& part : {map.axes[0], map.axes[1], map.axes[2], map.origin}) {
    if (!IsFinite(part)) return Fault(absl::StrCat(where, ": its place is not finite"));
  }
  int body = visit.body;
  bool shaped = false;
  if (const auto physics = node.extensions.find(kBodyExtension); physics != node.extensions.end()) {
    const tinygltf::Value& value = physics->second;
    if (value.Has("motion")) {
      if (absl::Status added = AddBody(visit, map, node, MemberOf(value, "motion")); !added.ok()) return added;
      body = static_cast<int>(bodies_.size()) - 1;
    } else if (value.Has("type")) {
      Count("bodies in the older form of OMI_physics_body");
    }
    for (const auto& [key, trigger] : {std::pair("collider", false), std::pair("trigger", true)}) {
      const tinygltf::Value& part = MemberOf(value, key);
      if (!MemberOf(part, "shape").IsInt()) continue;
      shaped = true;
      if (absl::Status added = AddShape(body, map, node, IndexIn(part, "shape"), trigger); !added.ok()) return added;
    }
  }
  // A node that belongs to a body, or has a shape for physics, gives its mesh to be drawn alone.
  if (node.mesh >= 0 && body >= 0) bodies_[static_cast<std::size_t>(body)].drawn.push_back({node.mesh, map});
  if (node.mesh >= 0 && body < 0 && !shaped) {
    if (absl::Status added = AddMesh(map, node, where); !added.ok()) return added;
  }
  if (node.mesh < 0 && absl::StartsWithIgnoreCase(node.name, "spawn")) {
    *result_.scene.mutable_player()->add_spawn_points() = ToProto(map.origin + Vec3d{0, kSpawnHeight_m, 0});
    ++result_.spawn_points;
  }
  if (node.camera >= 0) Count("cameras");
  if (node.skin >= 0) Count("skins, whose meshes stand as they were modelled");
  if (node.extensions.contains("KHR_lights_punctual")) Count("lights");
  if (node.extensions.contains("KHR_physics_rigid_bodies")) Count("bodies of KHR_physics_rigid_bodies");
  for (auto child = node.children.rbegin(); child != node.children.rend(); ++child) next.push_back({*child, map, body});
  return absl::OkStatus();
}

absl::Status Importer::AddBody(const Visit& visit, const Affine& map, const tinygltf::Node& node,
                               const tinygltf::Value& motion) {
  const std::string where = Where(visit.node);
  const auto placed = Parts(map);
  if (!placed) return Fault(absl::StrCat(where, ": a body cannot be sheared or flat"));
  Body body{where, map, placed->pose, {}, {}, {}};
  body.proto.set_name(NameOf(node));
  const std::string type = StringIn(motion, "type", "");
  if (type == "static") {
    body.proto.set_motion(v1::MOTION_STATIC);
  } else if (type == "kinematic") {
    body.proto.mutable_kinematic();
  } else if (type == "dynamic") {
    body.proto.set_motion(v1::MOTION_DYNAMIC);
    body.proto.set_mass(NumberIn(motion, "mass", 1));
    if (const double gravity = NumberIn(motion, "gravityFactor", 1); gravity != 1)
      body.proto.set_gravity_scale(gravity);
    const auto velocity = [&](const char* key, auto set) -> absl::Status {
      const tinygltf::Value& list = MemberOf(motion, key);
      if (!list.IsArray()) return absl::OkStatus();
      const auto v = VectorOf(list);
      if (!v) return Fault(absl::StrCat(where, ": ", kBodyExtension, ".motion.", key, " is no vector"));
      set(Rotate(placed->pose.orientation, *v));
      return absl::OkStatus();
    };
    absl::Status status =
        velocity("linearVelocity", [&](Vec3d v) { *body.proto.mutable_linear_velocity() = ToProto(v); });
    status.Update(velocity("angularVelocity", [&](Vec3d v) { *body.proto.mutable_angular_velocity() = ToProto(v); }));
    if (!status.ok()) return status;
    // A body's are those of its shape at even density.
    for (const auto& [key, what] : {std::pair("centerOfMass", "centres of mass beside those of their shapes"),
                                    std::pair("inertiaDiagonal", "moments of inertia beside those of their shapes")}) {
      const auto given = VectorOf(MemberOf(motion, key));
      if (given && !(*given == Vec3d{})) Count(what);
    }
  } else {
    return Fault(
        absl::StrCat(where, ": ", kBodyExtension, ".motion.type is \"", type, "\", not static, kinematic or dynamic"));
  }
  bodies_.push_back(std::move(body));
  return absl::OkStatus();
}

absl::Status Importer::AddShape(int body, const Affine& map, const tinygltf::Node& node, int shape, bool trigger) {
  const int index = static_cast<int>(&node - model_.nodes.data());
  const std::string where = Where(index);
  if (trigger && body >= 0 && bodies_[static_cast<std::size_t>(body)].proto.motion() != v1::MOTION_STATIC) {
    Count("triggers of bodies that move");
    return absl::OkStatus();
  }
  const auto part = ReadShape(model_, shape, map, where);
  if (!part.ok()) return part.status();
  if (body >= 0 && !trigger) {
    bodies_[static_cast<std::size_t>(body)].parts.push_back(*part);
    return absl::OkStatus();
  }
  Body alone{where, map, part->pose, {}, {*part}, {}};
  if (node.mesh >= 0 && !trigger) alone.drawn.push_back({node.mesh, map});
  alone.proto.set_name(NameOf(node));
  alone.proto.set_motion(v1::MOTION_STATIC);
  alone.proto.set_trigger(trigger);
  return FinishBody(alone);
}

absl::Status Importer::FinishBody(Body& body) {
  if (body.parts.empty()) {
    Count("bodies without a shape");
    return absl::OkStatus();
  }
  const bool moves = body.proto.motion() != v1::MOTION_STATIC;
  auto shape = JoinParts(body.parts, body.pose, moves, body.where);
  if (!shape.ok()) return shape.status();
  *body.proto.mutable_shape() = std::move(shape->shape);
  if (shape->thinned) {
    result_.notes.push_back(absl::StrCat(body.where, ": its hull was thinned to ", kMaxHullPoints, " points"));
  }
  if (!body.proto.trigger()) Draw(body.drawn, body.pose, *body.proto.mutable_shape());
  auto& count = body.proto.trigger()                       ? result_.triggers
                : body.proto.has_kinematic()               ? result_.kinematic_bodies
                : body.proto.motion() == v1::MOTION_STATIC ? result_.static_bodies
                                                           : result_.dynamic_bodies;
  ++count;
  const Pose pose{body.pose.position + Rotate(body.pose.orientation, shape->center), body.pose.orientation};
  return Place(body.where, std::move(body.proto), pose, shape->box);
}

absl::Status Importer::AddMesh(const Affine& map, const tinygltf::Node& node, const std::string& where) {
  auto found = meshes_.find(node.mesh);
  if (found == meshes_.end()) {
    auto read = ReadMesh(model_, node.mesh);
    if (!read.ok()) return read.status();
    left_out_["primitives of points or lines"] += read->other_primitives;
    found = meshes_.emplace(node.mesh, *std::move(read)).first;
  }
  Triangles triangles = found->second;
  for (Vec3d& vertex : triangles.vertices) vertex = map.Turned(vertex);
  if (map.Determinant() < 0) {
    for (std::size_t i = 0; i + 2 < triangles.indices.size(); i += 3) {
      std::swap(triangles.indices[i + 1], triangles.indices[i + 2]);
    }
  }
  DropDegenerate(triangles);
  left_out_["triangles without area"] += triangles.degenerate;
  if (triangles.indices.empty()) {
    Count("meshes without a triangle");
    return absl::OkStatus();
  }
  v1::Body body;
  body.set_name(NameOf(node));
  body.set_motion(v1::MOTION_STATIC);
  auto& mesh = *body.mutable_shape()->mutable_mesh();
  Aabb box{map.origin, map.origin};
  for (const Vec3d& vertex : triangles.vertices) {
    *mesh.add_vertices() = ToProto(vertex);
    const Vec3d at = vertex + map.origin;
    box.min = {std::min(box.min.x, at.x), std::min(box.min.y, at.y), std::min(box.min.z, at.z)};
    box.max = {std::max(box.max.x, at.x), std::max(box.max.y, at.y), std::max(box.max.z, at.z)};
  }
  mesh.mutable_indices()->Assign(triangles.indices.begin(), triangles.indices.end());
  result_.triangles += triangles.indices.size() / 3;
  ++result_.static_bodies;
  Draw({{node.mesh, map}}, {map.origin, {}}, *body.mutable_shape());
  return Place(where, std::move(body), {map.origin, {}}, box);
}

absl::Status Importer::Place(const std::string& where, v1::Body body, const Pose& pose, const Aabb& box) {
  const double extent = std::max({box.max.x - box.min.x, box.max.y - box.min.y, box.max.z - box.min.z});
  const double far = std::max({std::abs(box.min.x), std::abs(box.min.y), std::abs(box.min.z), std::abs(box.max.x),
                               std::abs(box.max.y), std::abs(box.max.z)});
  if (!(far <= kMaxCoordinate_m / 2) || !(extent <= kMaxExtent_m)) {
    return Fault(absl::StrCat(where, ": is ", extent, " m large and reaches ", far,
                              " m from the origin; a body has at most ", kMaxExtent_m, " m. Is its scale in metres?"));
  }
  body.set_id(static_cast<std::uint64_t>(result_.scene.bodies_size()) + 1);
  *body.mutable_pose() = ToProto(pose);
  *result_.scene.add_bodies() = std::move(body);
  if (!box_) box_ = box;
  box_->min = {std::min(box_->min.x, box.min.x), std::min(box_->min.y, box.min.y), std::min(box_->min.z, box.min.z)};
  box_->max = {std::max(box_->max.x, box.max.x), std::max(box_->max.y, box.max.y), std::max(box_->max.z, box.max.z)};
  return absl::OkStatus();
}

void Importer::SetBounds() {
  for (const v1::Vec3& spawn : result_.scene.player().spawn_points()) {
    box_->min = {std::min(box_->min.x, spawn.x()), std::min(box_->min.y, spawn.y()), std::min(box_->min.z, spawn.z())};
    box_->max = {std::max(box_->max.x, spawn.x()), std::max(box_->max.y, spawn.y()), std::max(box_->max.z, spawn.z())};
  }
  const auto whole = [](double low, double high) { return std::pair(std::floor(low), std::ceil(high)); };
  const auto [x0, x1] = whole(box_->min.x - kMargin_m, box_->max.x + kMargin_m);
  const auto [y0, y1] = whole(box_->min.y - kMargin_m, box_->max.y + kAbove_m);
  const auto [z0, z1] = whole(box_->min.z - kMargin_m, box_->max.z + kMargin_m);
  *result_.scene.mutable_bounds()->mutable_min() = ToProto(Vec3d{x0, y0, z0});
  *result_.scene.mutable_bounds()->mutable_max() = ToProto(Vec3d{x1, y1, z1});
  if (!result_.scene.has_player()) return;
  v1::PlayerRules& player = *result_.scene.mutable_player();
  player.mutable_body()->set_mass(80);
  player.mutable_body()->mutable_shape()->mutable_capsule()->set_radius(0.4);
  player.mutable_body()->mutable_shape()->mutable_capsule()->set_half_height(0.5);
  player.mutable_character()->set_walk_speed(4);
  player.mutable_character()->set_run_speed(8);
  player.mutable_character()->set_jump_speed(5);
}

// A shape is drawn by all of these meshes, or by none: a half would look like the whole.
void Importer::Draw(const std::vector<DrawnMesh>& drawn, const Pose& pose, v1::Shape& shape) {
  if (drawn.empty()) return;
  if (drawn.size() > kMaxVisuals) return Count(absl::StrCat("bodies of more than ", kMaxVisuals, " meshes to draw"));
  std::vector<v1::Visual> visuals;
  visuals.reserve(drawn.size());
  for (const DrawnMesh& one : drawn) {
    auto visual = PlacedVisual(Seen(pose, one.map));
    if (!visual) return Count("sheared, flat or absurdly scaled meshes to draw");
    visuals.push_back(*std::move(visual));
  }
  for (std::size_t i = 0; i < drawn.size(); ++i) {
    const auto number = visuals_.Add(drawn[i].mesh);
    if (!number) return;
    visuals[i].set_mesh(*number);
  }
  for (v1::Visual& visual : visuals) *shape.add_visuals() = std::move(visual);
}

// The file can be named once it is whole.
void Importer::KeepVisuals() {
  result_.visual_file = visuals_.Glb();
  if (!result_.visual_file.empty()) {
    result_.visual_sha256 = Sha256Hex(result_.visual_file);
    result_.drawn_triangles = visuals_.triangles();
  } else if (visuals_.triangles() > 0) {
    result_.notes.push_back(absl::StrCat("shapes are drawn in place of meshes: these have ", visuals_.triangles(),
                                         " triangles or more, and a file for them takes ", kMaxVisualTriangles, " and ",
                                         kMaxVisualFile_bytes >> 20, " MiB"));
  }
  for (v1::Body& body : *result_.scene.mutable_bodies()) {
    v1::Shape& shape = *body.mutable_shape();
    if (result_.visual_file.empty()) shape.clear_visuals();
    for (v1::Visual& visual : *shape.mutable_visuals()) visual.set_sha256(result_.visual_sha256);
  }
  result_.notes.insert(result_.notes.end(), visuals_.notes().begin(), visuals_.notes().end());
  left_out_["textures of surfaces, which are drawn in their base colour"] += visuals_.textures();
}

void Importer::NoteRest() {
  if (!model_.animations.empty()) left_out_["animations"] = model_.animations.size();
  for (const auto& [what, count] : left_out_) {
    if (count != 0) result_.notes.push_back(absl::StrCat("left out: ", count, " ", what));
  }
  if (result_.spawn_points == 0) {
    result_.notes.push_back("nobody can play in it: name empty nodes spawn, spawn.001, ... where players begin");
  }
}

}  // namespace

absl::StatusOr<GltfImport> ImportGltf(std::span<const std::uint8_t> bytes, const std::string& folder,
                                      const std::string& name) {
  Pictures pictures;
  const auto model = Load(bytes, folder, pictures);
  if (!model.ok()) return model.status();
  return Importer(*model, pictures, name).Run();
}

}  // namespace tessera::cli
