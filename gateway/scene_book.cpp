#include "gateway/scene_book.h"

#include <algorithm>
#include <optional>
#include <string_view>
#include <utility>

#include "core/physics/collide/hull_growth.h"
#include "core/physics/mass_properties.h"
#include "core/world/byte_view.h"
#include "core/world/sha256.h"
#include "gateway/viewer_format.h"

namespace tessera::gateway {
namespace {

Vec3f Narrow(const Vec3d& v) { return Vec3f(v); }

void PutQuaternion(const Quatd& q, ByteWriter& out) {
  out.F32(static_cast<float>(q.x));
  out.F32(static_cast<float>(q.y));
  out.F32(static_cast<float>(q.z));
  out.F32(static_cast<float>(q.w));
}

void PutSurface(std::span<const Vec3f> vertices, std::span<const std::array<std::uint32_t, 3>> triangles,
                ByteWriter& out) {
  out.Varint(vertices.size());
  for (const Vec3f& vertex : vertices) out.V(vertex);
  out.Varint(triangles.size());
  for (const auto& triangle : triangles) {
    for (const std::uint32_t corner : triangle) out.U32(corner);
  }
}

bool NeverMoves(const BodyDef& def) { return def.motion == Motion::kStatic && def.path == nullptr; }

// The shapes that more than one tile has, in the order of tiles.
std::vector<ShapePtr> SharedByTiles(const LevelCut& cut) {
  std::unordered_map<const Shape*, const Tile*> first;
  std::vector<ShapePtr> shared;
  for (const auto& [square, tile] : cut.tiles) {
    for (const TilePart& part : tile.parts) {
      if (first.try_emplace(part.body.shape.get(), &tile).first->second != &tile) shared.push_back(part.body.shape);
    }
  }
  return shared;
}

}  // namespace

// The part behind the number and the kind of a shape, which is its place among the scene's forms. One overload a form.
struct SceneBook::PutForm {
  const std::unordered_map<const Shape*, std::uint32_t>& numbers;
  const FieldPlace& place;
  ByteWriter& out;

  void Floats(std::initializer_list<double> values) const {
    for (const double value : values) out.F32(static_cast<float>(value));
  }
  void operator()(const BoxShape& s) const { Floats({s.half_extents_m.x, s.half_extents_m.y, s.half_extents_m.z}); }
  void operator()(const SphereShape& s) const { Floats({s.radius_m}); }
  void operator()(const CapsuleShape& s) const { Floats({s.radius_m, s.half_height_m}); }
  void operator()(const CylinderShape& s) const { Floats({s.radius_m, s.half_height_m}); }
  void operator()(const ConeShape& s) const { Floats({s.radius_m, s.height_m}); }
  void operator()(const ConvexHullShape& s) const {
    // Points nearer to the surface than this are on it: nobody sees a micrometre.
    constexpr double kRounding = 1e-6;
    std::vector<std::array<std::uint32_t, 3>> triangles;
    const physics::GrownHull hull = physics::GrowHull(s.points, kRounding);
    triangles.reserve(hull.triangles.size());
    for (const physics::HullTriangle& triangle : hull.triangles) triangles.push_back(triangle.v);
    PutSurface(s.points, triangles, out);
  }
  void operator()(const CompoundShape& s) const {
    out.Varint(s.children.size());
    for (const CompoundChild& child : s.children) {
      out.Varint(numbers.at(child.shape.get()));
      out.V(Narrow(child.pose.position));
      PutQuaternion(child.pose.orientation, out);
    }
  }
  void operator()(const TriangleMeshShape& s) const { PutSurface(s.vertices, s.triangles, out); }
  // With the samples of its neighbours, where it is a part: they give the ground at its rim the slope of the whole.
  void operator()(const HeightFieldShape& s) const {
    const HeightFieldShape& whole = place.whole == nullptr ? s : *place.whole;
    const std::uint32_t from_x = place.cut.first_column, to_x = from_x + s.columns;
    const std::uint32_t from_z = place.cut.first_row, to_z = from_z + s.rows;
    const std::uint32_t left = from_x > 0 ? 1 : 0, right = to_x < whole.columns ? 1 : 0;
    const std::uint32_t near = from_z > 0 ? 1 : 0, far = to_z < whole.rows ? 1 : 0;
    out.Varint(s.columns);
    out.Varint(s.rows);
    Floats({s.spacing_m});
    out.U8(static_cast<std::uint8_t>(left | right << 1 | near << 2 | far << 3));
    for (std::uint32_t z = from_z - near; z < to_z + far; ++z) {
      for (std::uint32_t x = from_x - left; x < to_x + right; ++x) {
        out.F32(whole.heights_m[static_cast<std::size_t>(z) * whole.columns + x]);
      }
    }
  }
  void operator()(const PlaneShape& s) const { Floats({s.normal.x, s.normal.y, s.normal.z, s.offset_m}); }
};

SceneBook::SceneBook(const Scene& scene) {
  const std::optional<LevelCut> cut = CutLevel(scene);
  const auto in_tiles = [&](const BodyDef& def) { return cut && std::ranges::binary_search(cut->in_tiles, def.id); };
  for (const BodyDef& def : scene.bodies) {
    if (!in_tiles(def)) AddShape(def.shape);
  }
  if (scene.player) AddShape(scene.player->body.shape);
  for (const Prefab& prefab : scene.prefabs) {
    for (const BodyDef& def : prefab.bodies) AddShape(def.shape);
  }
  if (cut) {
    for (const ShapePtr& shape : SharedByTiles(*cut)) AddShape(shape);
  }
  EndShapes();
  for (const BodyDef& def : scene.bodies) {
    if (NeverMoves(def) && !in_tiles(def)) AddStatic(def, {def.initial.position, def.initial.orientation});
  }
  Flush(static_cast<std::uint8_t>(MessageKind::kStatics), true);
  if (cut) AddTiles(scene, *cut);
}

std::shared_ptr<const std::string> SceneBook::TileBy(const std::string& sha256) const {
  const auto found = tiles_.find(sha256);
  return found == tiles_.end() ? nullptr : found->second;
}

void SceneBook::EndShapes() {
  Flush(static_cast<std::uint8_t>(MessageKind::kShapes), true);
  for (const ShapePtr& shape : drawn_) AddVisuals(shape);
  drawn_.clear();
  Flush(static_cast<std::uint8_t>(MessageKind::kVisuals), true);
}

void SceneBook::AddTiles(const Scene& scene, const LevelCut& cut) {
  std::unordered_map<BodyId, const HeightFieldShape*> fields;
  for (const BodyDef& def : scene.bodies) {
    if (const auto* field = std::get_if<HeightFieldShape>(&def.shape->form)) fields.emplace(def.id, field);
  }
  ByteWriter list;
  list.U8(static_cast<std::uint8_t>(MessageKind::kTiles));
  list.Varint(cut.tiles.size());
  std::vector<Bytes> of_scene = std::exchange(messages_, {});
  for (const auto& [square, tile] : cut.tiles) {
    for (const TilePart& part : tile.parts) {
      AddShape(part.body.shape, part.field ? FieldPlace{fields.at(part.body.id), *part.field} : FieldPlace{});
    }
    EndShapes();
    for (const TilePart& part : tile.parts) AddStatic(part.body, PoseOf(part));
    Flush(static_cast<std::uint8_t>(MessageKind::kStatics), true);
    ByteWriter content;
    for (const Bytes& message : std::exchange(messages_, {})) content.Block(message);
    auto bytes = std::make_shared<const std::string>(AsText(content.bytes()));
    const std::string sha256 = Sha256Hex(*bytes);
    const Aabb bounds = BoundsOf(tile);
    list.V(Narrow(bounds.min));
    list.V(Narrow(bounds.max));
    list.Varint(bytes->size());
    list.Block(std::string_view(sha256));
    tiles_.emplace(sha256, std::move(bytes));
  }
  messages_ = std::move(of_scene);
  messages_.push_back(list.Take());
}

std::uint32_t SceneBook::NumberOf(const Shape& shape) const {
  const auto found = numbers_.find(&shape);
  return found == numbers_.end() ? 0 : found->second;
}

void SceneBook::AddShape(const ShapePtr& shape, const FieldPlace& place) {
  if (shape == nullptr || numbers_.contains(shape.get())) return;
  if (const auto* compound = std::get_if<CompoundShape>(&shape->form)) {
    for (const CompoundChild& child : compound->children) AddShape(child.shape);
  }
  Flush(static_cast<std::uint8_t>(MessageKind::kShapes), false);
  const auto number = static_cast<std::uint32_t>(origins_.size());
  numbers_.emplace(shape.get(), number);
  BodyDef moving;
  moving.shape = shape;
  origins_.push_back(-physics::CenterOfMass(moving));
  pending_.Varint(number);
  pending_.U8(static_cast<std::uint8_t>(shape->form.index()));
  std::visit(PutForm{numbers_, place, pending_}, shape->form);
  ++pending_count_;
  if (!shape->visuals.empty()) drawn_.push_back(shape);
}

void SceneBook::AddVisuals(const ShapePtr& shape) {
  Flush(static_cast<std::uint8_t>(MessageKind::kVisuals), false);
  pending_.Varint(numbers_.at(shape.get()));
  pending_.Varint(shape->visuals.size());
  for (const Visual& visual : shape->visuals) {
    pending_.Block(std::string_view(visual.sha256));
    pending_.Varint(visual.mesh);
    pending_.V(Narrow(visual.pose.position));
    PutQuaternion(visual.pose.orientation, pending_);
    pending_.V(Narrow(visual.scale));
  }
  ++pending_count_;
}

void SceneBook::AddStatic(const BodyDef& def, const Pose& pose) {
  Flush(static_cast<std::uint8_t>(MessageKind::kStatics), false);
  pending_.Varint(def.id.value());
  pending_.Block(std::string_view(def.name));
  pending_.Varint(numbers_.at(def.shape.get()));
  pending_.U8(def.trigger ? kTriggerFlag : 0);
  pending_.V(pose.position);
  PutQuaternion(pose.orientation, pending_);
  ++pending_count_;
}

// Ends the message under way if it is `all` there is, or large enough.
void SceneBook::Flush(std::uint8_t kind, bool all) {
  if (pending_count_ == 0 || (!all && pending_.size() < kMaxSceneMessage_bytes / 2)) return;
  ByteWriter message;
  message.U8(kind);
  message.Varint(pending_count_);
  message.Bytes(pending_.bytes());
  messages_.push_back(message.Take());
  (void)pending_.Take();
  pending_count_ = 0;
}

}  // namespace tessera::gateway
