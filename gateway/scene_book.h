// SceneBook: what viewers of a world are sent once: the shapes of its scene, numbered, the meshes that are drawn in
// their place, and its static bodies. Of a large level they are sent the list of its tiles (core/world/level_tiles.h),
// which they get by their hashes as they need them.
//
// Numbers ascend from 1, those of a compound's children before its own. All messages are encoded once, and shared by
// all viewers of the scene. A pose that a viewer is sent is that of its shape's origin; a dynamic body's state is that
// of its centre of mass, and `OriginOf` leads from one to the other.
//
//   const SceneBook book(client.scene());
//   for (const Bytes& message : book.messages()) Send(message);
//
// Thread rule: constant once made; any thread.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include "core/world/bytes.h"
#include "core/world/level_tiles.h"
#include "core/world/scene.h"

namespace tessera::gateway {

using Bytes = std::vector<std::uint8_t>;

class SceneBook {
 public:
  explicit SceneBook(const Scene& scene);

  const std::vector<Bytes>& messages() const { return messages_; }  // shapes, visuals, statics, tiles
  // A tile by its SHA-256, 64 hexadecimal digits: its messages, each behind its length. Null: it is none of this scene.
  std::shared_ptr<const std::string> TileBy(const std::string& sha256) const;
  // 0 for a shape that is not the scene's.
  std::uint32_t NumberOf(const Shape& shape) const;
  // The origin of a dynamic body's shape as seen from its centre of mass, in the shape's axes.
  Vec3d OriginOf(std::uint32_t shape) const { return shape < origins_.size() ? origins_[shape] : Vec3d(); }

 private:
  // The field that a shape is a part of, and where.
  struct FieldPlace {
    const HeightFieldShape* whole = nullptr;
    FieldCut cut{};
  };
  struct PutForm;

  void AddShape(const ShapePtr& shape) { AddShape(shape, {}); }
  void AddShape(const ShapePtr& shape, const FieldPlace& place);
  void AddVisuals(const ShapePtr& shape);
  void AddStatic(const BodyDef& def, const Pose& pose);
  void EndShapes();
  void AddTiles(const Scene& scene, const LevelCut& cut);
  void Flush(std::uint8_t kind, bool all);

  std::unordered_map<const Shape*, std::uint32_t> numbers_;
  std::vector<ShapePtr> drawn_;          // shapes with visuals, ascending by number
  std::vector<Vec3d> origins_{Vec3d()};  // by number
  std::vector<Bytes> messages_;
  std::unordered_map<std::string, std::shared_ptr<const std::string>> tiles_;  // by hash
  // The message under way.
  ByteWriter pending_;
  std::uint64_t pending_count_ = 0;
};

}  // namespace tessera::gateway
