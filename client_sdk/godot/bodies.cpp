#include "bodies.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "meshes.h"

namespace godot_plugin {
namespace {

// The engine's Mesh has these places in the arrays of a surface, so many of them, and this kind of primitive.
constexpr std::int64_t kPositions = 0, kNormals = 1, kTriangles = 3;
constexpr std::size_t kSurfaceArrays = 13;
constexpr std::int64_t kTransform3dFormat = 1;  // a format of MultiMesh
constexpr std::size_t kFloatsAnInstance = 12;

Pose PoseOf(const double* position, const double* orientation) {
  return {{position[0], position[1], position[2]}, {orientation[0], orientation[1], orientation[2], orientation[3]}};
}

// Nil where there is nothing to draw.
Value MeshOf(const desktop::Mesh& triangles) {
  if (triangles.empty()) return {};
  std::vector<float> positions, normals;
  positions.reserve(triangles.size() * 3);
  normals.reserve(triangles.size() * 3);
  for (std::size_t first = 0; first + 2 < triangles.size(); first += 3) {
    for (const std::size_t corner : {first, first + 2, first + 1}) {  // the engine sees clockwise triangles
      const desktop::Vertex& at = triangles[corner];
      positions.insert(positions.end(), {at.position.x, at.position.y, at.position.z});
      normals.insert(normals.end(), {at.normal.x, at.normal.y, at.normal.z});
    }
  }
  Value arrays = Value::Array(kSurfaceArrays);
  arrays.Set(kPositions, Value::Vectors(positions));
  arrays.Set(kNormals, Value::Vectors(normals));
  Value mesh = NewObject("ArrayMesh");
  mesh.Call("add_surface_from_arrays", Value(kTriangles), arrays);
  return mesh;
}

}  // namespace

Bodies::Look* Bodies::LookOf(const tessera_shape* shape, Looks& looks) {
  const auto [at, is_new] = looks.try_emplace(shape);
  if (!is_new) return &at->second;
  for (const desktop::Part& part : desktop::PartsOf(shape)) {
    tessera_shape_info info = TESSERA_SHAPE_INFO;
    if (tessera_get_shape(part.shape, &info) != TESSERA_OK) continue;
    Value mesh = MeshOf(desktop::MeshOf(info, plane_half_m_));
    if (mesh.nil()) continue;
    Part& made = at->second.emplace_back();
    made.mesh = std::move(mesh);
    made.pose = {part.position, part.orientation};
  }
  return &at->second;
}

Value Bodies::NewNode(std::uint64_t id, const Look& look, const Pose& pose) {
  Value node = NewObject("Node3D");
  node.Call("set_name", Value("body_" + std::to_string(id)));
  for (const Part& part : look) {
    Value mesh = NewObject("MeshInstance3D");
    mesh.Call("set_mesh", part.mesh);
    mesh.Call(set_transform_, Value(part.pose));
    node.Call(add_child_, mesh);
  }
  node.Call(set_transform_, Value(pose));
  Value::Object(parent_).Call(add_child_, node);
  return node;
}

void Bodies::TakeScene(const tessera_client* client) {
  tessera_scene_info scene = TESSERA_SCENE_INFO;
  if (tessera_get_scene(client, &scene) != TESSERA_OK) return;
  double half_m = 0;
  for (const std::size_t axis : {0, 1, 2}) {
    half_m = std::max({half_m, std::abs(scene.bounds_min[axis]), std::abs(scene.bounds_max[axis])});
  }
  plane_half_m_ = static_cast<float>(half_m);
  if (drawing_ == Drawing::kNothing) return;
  for (std::size_t i = 0; i < scene.body_count; ++i) {
    tessera_body_info info = TESSERA_BODY_INFO;
    if (tessera_scene_body(client, i, &info) != TESSERA_OK || info.dynamic != 0 || info.trigger != 0) continue;
    statics_.emplace_back(NewNode(info.id, *LookOf(info.shape), PoseOf(info.position, info.orientation)));
  }
}

// Its shapes go with it, so their meshes are kept by its nodes alone.
void Bodies::TakeTile(const tessera_client* client, std::uint32_t tile) {
  tessera_tile_info info = TESSERA_TILE_INFO;
  if (drawing_ == Drawing::kNothing || tessera_get_tile(client, tile, &info) != TESSERA_OK) return;
  Looks looks;
  std::vector<Node>& nodes = tiles_[tile];
  for (std::size_t i = 0; i < info.body_count; ++i) {
    tessera_body_info body = TESSERA_BODY_INFO;
    if (tessera_tile_body(client, tile, i, &body) != TESSERA_OK) continue;
    nodes.emplace_back(NewNode(body.id, *LookOf(body.shape, looks), PoseOf(body.position, body.orientation)));
  }
}

void Bodies::DropTile(std::uint32_t tile) {
  const auto found = tiles_.find(tile);
  if (found == tiles_.end()) return;
  for (Node& node : found->second) node.Free();
  tiles_.erase(found);
}

void Bodies::Enter(const tessera_client* client, std::uint64_t id, const Pose& pose, Shown& shown) {
  tessera_body_info info = TESSERA_BODY_INFO;
  if (drawing_ == Drawing::kNothing || tessera_body_of(client, id, &info) != TESSERA_OK) return;
  shown.look = LookOf(info.shape);
  if (drawing_ == Drawing::kNodes) shown.node = Node(NewNode(id, *shown.look, pose));
}

void Bodies::Place(const Pose& pose, Shown& shown) {
  if (shown.look == nullptr) return;
  if (drawing_ == Drawing::kMultiMesh) {
    for (Part& part : *shown.look) {
      const std::array<float, kFloatsAnInstance> rows = pose.Of(part.pose).Rows();
      part.rows.insert(part.rows.end(), rows.begin(), rows.end());
    }
  } else if (!(pose == shown.pose)) {  // those asleep cost nothing
    if (void* node = shown.node.Find(); node != nullptr) Value::Object(node).Call(set_transform_, Value(pose));
  }
  shown.pose = pose;
}

void Bodies::SendInstances(Part& part) {
  const std::size_t count = part.rows.size() / kFloatsAnInstance;
  if (part.multimesh.nil()) {
    if (count == 0) return;
    part.multimesh = NewObject("MultiMesh");
    part.multimesh.Call("set_transform_format", Value(kTransform3dFormat));
    part.multimesh.Call("set_mesh", part.mesh);
    Value instances = NewObject("MultiMeshInstance3D");
    instances.Call("set_multimesh", part.multimesh);
    Value::Object(parent_).Call(add_child_, instances);
    part.instances = Node(instances);
  }
  if (count > part.room) {
    part.room = count + count / 2;
    part.multimesh.Call("set_instance_count", Value(static_cast<std::int64_t>(part.room)));
  }
  part.multimesh.Call("set_visible_instance_count", Value(static_cast<std::int64_t>(count)));
  part.rows.resize(part.room * kFloatsAnInstance);  // the engine wants all of them; those beyond are not drawn
  part.multimesh.Call(set_buffer_, Value::Floats(part.rows));
  part.rows.clear();
}

Bodies::Changes Bodies::Update(tessera_client* client, std::int64_t now_ns) {
  std::size_t count = 0;
  for (;;) {
    count = tessera_bodies(client, now_ns, bodies_.data(), sizeof(tessera_body), bodies_.size());
    if (count <= bodies_.size()) break;
    bodies_.resize(count + count / 2);
  }
  ++frame_;
  Changes changes;
  for (std::size_t i = 0; i < count; ++i) {
    const tessera_body& body = bodies_[i];
    const Pose pose = PoseOf(body.position, body.orientation);
    const auto [at, is_new] = shown_.try_emplace(body.id);
    at->second.frame = frame_;
    if (is_new) {
      changes.entered.push_back(body.id);
      Enter(client, body.id, pose, at->second);
    }
    Place(pose, at->second);
  }
  for (auto at = shown_.begin(); at != shown_.end();) {
    if (at->second.frame == frame_) {
      ++at;
      continue;
    }
    changes.left.push_back(at->first);
    at->second.node.Free();
    at = shown_.erase(at);
  }
  std::sort(changes.left.begin(), changes.left.end());
  if (drawing_ == Drawing::kMultiMesh) {
    for (auto& [shape, look] : looks_) {
      for (Part& part : look) SendInstances(part);
    }
  }
  return changes;
}

void* Bodies::NodeOf(std::uint64_t id) const {
  const auto at = shown_.find(id);
  return at == shown_.end() ? nullptr : at->second.node.Find();
}

void Bodies::Clear() {
  for (auto& [id, shown] : shown_) shown.node.Free();
  for (Node& node : statics_) node.Free();
  while (!tiles_.empty()) DropTile(tiles_.begin()->first);
  for (auto& [shape, look] : looks_) {
    for (Part& part : look) part.instances.Free();
  }
  shown_.clear();
  statics_.clear();
  looks_.clear();
}

}  // namespace godot_plugin
