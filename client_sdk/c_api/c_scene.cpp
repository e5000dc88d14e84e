// The C interface: the scene and its shapes.
#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "client_sdk/c_api/handle.h"

using namespace tessera;
using namespace tessera::c_api;

namespace tessera::c_api {
namespace {

static_assert(kMaxPropertyText == TESSERA_MAX_PROPERTY_TEXT);
static_assert(kMaxPropertyBlob == TESSERA_MAX_PROPERTY_BYTES);
static_assert(std::variant_size_v<PropertyValue> == TESSERA_PROPERTY_BYTES + 1);

const tessera_shape* HandleOf(const Shape& shape) { return reinterpret_cast<const tessera_shape*>(&shape); }
const Shape& ShapeOf(const tessera_shape* handle) { return *reinterpret_cast<const Shape*>(handle); }

void Put(const Vec3d& v, double* out) { out[0] = v.x, out[1] = v.y, out[2] = v.z; }
void Put(const Quatd& q, double* out) { out[0] = q.x, out[1] = q.y, out[2] = q.z, out[3] = q.w; }

static_assert(sizeof(Vec3f) == 3 * sizeof(float) && sizeof(std::array<std::uint32_t, 3>) == 3 * sizeof(uint32_t));

// One overload a form: what of it fits in a tessera_shape_info.
struct Describe {
  tessera_shape_info& info;

  void Kind(tessera_shape_kind kind, double a = 0, double b = 0, double c = 0, double d = 0) {
    info.kind = kind;
    info.dimensions[0] = a, info.dimensions[1] = b, info.dimensions[2] = c, info.dimensions[3] = d;
  }
  void operator()(const BoxShape& s) {
    Kind(TESSERA_SHAPE_BOX, s.half_extents_m.x, s.half_extents_m.y, s.half_extents_m.z);
  }
  void operator()(const SphereShape& s) { Kind(TESSERA_SHAPE_SPHERE, s.radius_m); }
  void operator()(const CapsuleShape& s) { Kind(TESSERA_SHAPE_CAPSULE, s.radius_m, s.half_height_m); }
  void operator()(const CylinderShape& s) { Kind(TESSERA_SHAPE_CYLINDER, s.radius_m, s.half_height_m); }
  void operator()(const ConeShape& s) { Kind(TESSERA_SHAPE_CONE, s.radius_m, s.height_m); }
  void operator()(const PlaneShape& s) { Kind(TESSERA_SHAPE_PLANE, s.normal.x, s.normal.y, s.normal.z, s.offset_m); }
  void operator()(const CompoundShape& s) {
    Kind(TESSERA_SHAPE_COMPOUND);
    info.child_count = s.children.size();
  }
  void operator()(const ConvexHullShape& s) {
    Kind(TESSERA_SHAPE_CONVEX_HULL);
    Vertices(s.points);
  }
  void operator()(const TriangleMeshShape& s) {
    Kind(TESSERA_SHAPE_MESH);
    Vertices(s.vertices);
    info.indices = s.triangles.empty() ? nullptr : s.triangles.front().data();
    info.index_count = 3 * s.triangles.size();
  }
  void operator()(const HeightFieldShape& s) {
    Kind(TESSERA_SHAPE_HEIGHT_FIELD);
    info.vertices = s.heights_m.data();
    info.vertex_count = s.heights_m.size();
    info.columns = s.columns;
    info.rows = s.rows;
    info.spacing = s.spacing_m;
  }
  void Vertices(const std::vector<Vec3f>& points) {
    info.vertices = points.empty() ? nullptr : &points.front().x;
    info.vertex_count = points.size();
  }
};

tessera_body_info InfoOf(const BodyDef& def) {
  tessera_body_info info = TESSERA_BODY_INFO;
  info.id = def.id.value();
  info.dynamic = def.motion == Motion::kDynamic || def.path != nullptr ? 1 : 0;
  info.name = def.name.c_str();
  info.shape = HandleOf(*def.shape);
  info.mass_kg = def.mass_kg;
  info.trigger = def.trigger ? 1 : 0;
  Put(def.initial.position, info.position);
  Put(def.initial.orientation, info.orientation);
  return info;
}

tessera_property PropertyFrom(const PropertyValue& value) {
  tessera_property property = TESSERA_PROPERTY;
  property.type = static_cast<tessera_property_type>(value.index());
  if (const bool* flag = std::get_if<bool>(&value)) property.integer = *flag ? 1 : 0;
  if (const std::int64_t* number = std::get_if<std::int64_t>(&value)) property.integer = *number;
  if (const double* number = std::get_if<double>(&value)) property.real = *number;
  if (const std::string* text = std::get_if<std::string>(&value)) text->copy(property.text, kMaxPropertyText);
  if (const Vec3d* vector = std::get_if<Vec3d>(&value)) {
    property.vector[0] = vector->x, property.vector[1] = vector->y, property.vector[2] = vector->z;
  }
  if (const BodyId* body = std::get_if<BodyId>(&value)) property.body = body->value();
  if (const PropertyBytes* blob = std::get_if<PropertyBytes>(&value)) {
    property.byte_count = static_cast<std::uint32_t>(blob->bytes.size());
    std::ranges::copy(blob->bytes, property.bytes);
  }
  return property;
}

}  // namespace
}  // namespace tessera::c_api

tessera_code tessera_get_scene(const tessera_client* handle, tessera_scene_info* out) {
  if (handle == nullptr || out == nullptr) return Refuse("client or scene: is NULL");
  if (!IsSize<tessera_scene_info>(out->size, "scene.size")) return TESSERA_INVALID_ARGUMENT;
  const Scene& scene = handle->client->scene();
  tessera_scene_info info = TESSERA_SCENE_INFO;
  info.tick_rate_hz = scene.tick_rate_hz;
  info.name = scene.name.c_str();
  Put(scene.bounds.min, info.bounds_min);
  Put(scene.bounds.max, info.bounds_max);
  Put(scene.gravity_m_s2, info.gravity);
  info.body_count = scene.bodies.size();
  if (const LevelIndex* tiles = handle->client->Tiles()) {
    info.tile_count = tiles->tiles.size();
    info.tile_edge = tiles->edge_m;
  }
  if (scene.player) {
    info.player_max_force_n = scene.player->max_force_n;
    info.player_max_speed_m_s = scene.player->max_speed_m_s;
    if (const auto& character = scene.player->character; character.has_value()) {
      info.character_walk_speed_m_s = character->walk_speed_m_s;
      info.character_run_speed_m_s = character->run_speed_m_s;
    }
  }
  GiveOut(info, out);
  return TESSERA_OK;
}

tessera_code tessera_scene_body(const tessera_client* handle, size_t index, tessera_body_info* out) {
  if (handle == nullptr || out == nullptr) return Refuse("client or info: is NULL");
  if (!IsSize<tessera_body_info>(out->size, "info.size")) return TESSERA_INVALID_ARGUMENT;
  const std::vector<BodyDef>& bodies = handle->client->scene().bodies;
  if (index >= bodies.size()) return Refuse("index: beyond the scene's bodies");
  GiveOut(InfoOf(bodies[index]), out);
  return TESSERA_OK;
}

tessera_code tessera_body_of(const tessera_client* handle, uint64_t id, tessera_body_info* out) {
  if (handle == nullptr || out == nullptr) return Refuse("client or info: is NULL");
  if (!IsSize<tessera_body_info>(out->size, "info.size")) return TESSERA_INVALID_ARGUMENT;
  const BodyDef* def = handle->client->DefOf(BodyId(id));
  if (def == nullptr) return Report(absl::NotFoundError("body: the scene has none of that id"));
  tessera_body_info info = InfoOf(*def);
  info.id = id;
  GiveOut(info, out);
  return TESSERA_OK;
}

tessera_code tessera_get_tile(const tessera_client* handle, uint32_t tile, tessera_tile_info* out) {
  if (handle == nullptr || out == nullptr) return Refuse("client or info: is NULL");
  if (!IsSize<tessera_tile_info>(out->size, "info.size")) return TESSERA_INVALID_ARGUMENT;
  const LevelIndex* index = handle->client->Tiles();
  if (index == nullptr || tile >= index->tiles.size()) return Refuse("tile: beyond the scene's tiles");
  const TileEntry& entry = index->tiles[tile];
  tessera_tile_info info = TESSERA_TILE_INFO;
  info.row = entry.square.row;
  info.column = entry.square.column;
  Put(entry.bounds.min, info.bounds_min);
  Put(entry.bounds.max, info.bounds_max);
  info.bytes = entry.bytes;
  if (const std::shared_ptr<const Tile> content = handle->client->TileAt(tile)) {
    info.here = 1;
    info.body_count = content->parts.size();
  }
  GiveOut(info, out);
  return TESSERA_OK;
}

tessera_code tessera_tile_body(const tessera_client* handle, uint32_t tile, size_t index, tessera_body_info* out) {
  if (handle == nullptr || out == nullptr) return Refuse("client or info: is NULL");
  if (!IsSize<tessera_body_info>(out->size, "info.size")) return TESSERA_INVALID_ARGUMENT;
  const LevelIndex* tiles = handle->client->Tiles();
  if (tiles == nullptr || tile >= tiles->tiles.size()) return Refuse("tile: beyond the scene's tiles");
  const std::shared_ptr<const Tile> content = handle->client->TileAt(tile);
  if (content == nullptr) return Report(absl::NotFoundError("tile: is not here"));
  if (index >= content->parts.size()) return Refuse("index: beyond the tile's bodies");
  const TilePart& part = content->parts[index];
  tessera_body_info info = InfoOf(part.body);
  const Pose pose = PoseOf(part);
  Put(pose.position, info.position);
  Put(pose.orientation, info.orientation);
  GiveOut(info, out);
  return TESSERA_OK;
}

tessera_code tessera_view_tiles(tessera_client* handle, const double centre[3], double radius) {
  if (handle == nullptr) return Refuse("client: is NULL");
  if (!(radius >= 0)) return Refuse("radius: is negative, or not a number");
  std::optional<Vec3d> at;
  if (centre != nullptr) at = Vec3d{centre[0], centre[1], centre[2]};
  if (at && !IsFinite(*at)) return Refuse("centre: is not finite");
  handle->client->ViewTiles(at, radius);
  return TESSERA_OK;
}

tessera_code tessera_get_property(const tessera_client* handle, uint64_t id, const char* name, tessera_property* out) {
  if (handle == nullptr || name == nullptr || out == nullptr) return Refuse("client, name or property: is NULL");
  if (!IsSize<tessera_property>(out->size, "property.size")) return TESSERA_INVALID_ARGUMENT;
  return Guarded([&] {
    const client::Client& client = *handle->client;
    if (client.DefOf(BodyId(id)) == nullptr) return Report(absl::NotFoundError("body: the scene has none of that id"));
    const std::optional<PropertyValue> value = client.PropertyOf(BodyId(id), name);
    if (!value) return Report(absl::NotFoundError("name: the scene declares no such property"));
    GiveOut(PropertyFrom(*value), out);
    return tessera_code{TESSERA_OK};
  });
}

tessera_code tessera_get_world_property(const tessera_client* handle, const char* name, tessera_property* out) {
  if (handle == nullptr || name == nullptr || out == nullptr) return Refuse("client, name or property: is NULL");
  if (!IsSize<tessera_property>(out->size, "property.size")) return TESSERA_INVALID_ARGUMENT;
  return Guarded([&] {
    const std::optional<PropertyValue> value = handle->client->WorldPropertyOf(name);
    if (!value) return Report(absl::NotFoundError("name: the scene declares no such property of the world"));
    GiveOut(PropertyFrom(*value), out);
    return tessera_code{TESSERA_OK};
  });
}

tessera_code tessera_get_shape(const tessera_shape* shape, tessera_shape_info* out) {
  if (shape == nullptr || out == nullptr) return Refuse("shape or info: is NULL");
  if (!IsSize<tessera_shape_info>(out->size, "info.size")) return TESSERA_INVALID_ARGUMENT;
  tessera_shape_info info = TESSERA_SHAPE_INFO;
  std::visit(Describe{info}, ShapeOf(shape).form);
  GiveOut(info, out);
  return TESSERA_OK;
}

tessera_code tessera_shape_child(const tessera_shape* shape, size_t index, const tessera_shape** child,
                                 double position[3], double orientation[4]) {
  if (shape == nullptr || child == nullptr) return Refuse("shape or child: is NULL");
  const auto* compound = std::get_if<CompoundShape>(&ShapeOf(shape).form);
  if (compound == nullptr || index >= compound->children.size()) return Refuse("index: beyond the shape's children");
  const CompoundChild& found = compound->children[index];
  *child = HandleOf(*found.shape);
  if (position != nullptr) Put(found.pose.position, position);
  if (orientation != nullptr) Put(found.pose.orientation, orientation);
  return TESSERA_OK;
}

tessera_code tessera_shape_visual(const tessera_shape* shape, size_t index, tessera_visual_info* out) {
  if (shape == nullptr || out == nullptr) return Refuse("shape or info: is NULL");
  if (!IsSize<tessera_visual_info>(out->size, "info.size")) return TESSERA_INVALID_ARGUMENT;
  const std::vector<Visual>& visuals = ShapeOf(shape).visuals;
  if (index >= visuals.size()) return Report(absl::NotFoundError("index: beyond the shape's visuals"));
  const Visual& visual = visuals[index];
  tessera_visual_info info = TESSERA_VISUAL_INFO;
  info.mesh = visual.mesh;
  info.sha256 = visual.sha256.c_str();
  Put(visual.pose.position, info.position);
  Put(visual.pose.orientation, info.orientation);
  Put(visual.scale, info.scale);
  GiveOut(info, out);
  return TESSERA_OK;
}
