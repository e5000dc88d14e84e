#include "core/world/packed_level.h"

#include <algorithm>
#include <optional>
#include <string_view>
#include <unordered_map>

#include "core/world/byte_view.h"
#include "core/world/packed_scene.h"
#include "core/world/sha256.h"

namespace tessera {
namespace {

using packed::PackReader;
using packed::PackWriter;

constexpr std::string_view kTileMagic = "TSRT";

// The scene without what is in tiles.
Scene SceneWithout(const Scene& scene, const std::vector<BodyId>& in_tiles) {
  Scene rest = scene;
  std::erase_if(rest.bodies, [&](const BodyDef& body) { return std::ranges::binary_search(in_tiles, body.id); });
  return rest;
}

// Adds the shapes that more than one tile has, so that they are sent once.
void AddShared(const LevelCut& cut, packed::ShapeTable& shapes) {
  packed::ShapeTable all(true);
  struct Use {
    const Tile* tile = nullptr;
    bool shared = false;
  };
  std::unordered_map<std::size_t, Use> uses;
  for (const auto& [square, tile] : cut.tiles) {
    for (const TilePart& part : tile.parts) {
      if (part.mesh != nullptr || part.field) continue;
      Use& use = uses.try_emplace(all.Add(part.body.shape), Use{&tile, false}).first->second;
      if (use.tile == &tile || use.shared) continue;
      use.shared = true;
      shapes.Add(part.body.shape);
    }
  }
}

std::vector<std::uint8_t> PackOn(const packed::ShapeTable& below, const Tile& tile, const Scene& scene) {
  packed::ShapeTable shapes(&below);
  for (const TilePart& part : tile.parts) shapes.Add(part.body.shape);
  const packed::Context context{shapes, scene.properties, scene.kinds.size(), scene.layers.size()};
  PackWriter io;
  shapes.Write(io);
  io.List("parts", tile.parts, 1, kMaxBodies, packed::kMinPartBytes,
          [&](const TilePart& part) { packed::PartOf(io, part, context); });
  ByteWriter out;
  out.Text(kTileMagic);
  out.U16(kPackedTileVersion);
  out.Bytes(io.Take());
  return out.Take();
}

absl::Status BadTile(const std::string& what) {
  return absl::InvalidArgumentError(absl::StrCat("packed tile: ", what));
}

// The content behind its head.
absl::StatusOr<std::span<const std::uint8_t>> ContentOf(std::span<const std::uint8_t> bytes) {
  if (bytes.size() > kMaxTile_bytes) return BadTile(absl::StrCat("has ", bytes.size(), " bytes"));
  ByteReader in(bytes);
  if (AsText(in.Bytes(kTileMagic.size())) != kTileMagic) return BadTile("this is none");
  const std::uint16_t version = in.U16();
  if (!in.ok()) return BadTile("truncated");
  if (version != kPackedTileVersion) {
    return BadTile(absl::StrCat("of version ", version, "; this program reads ", kPackedTileVersion));
  }
  return in.rest();
}

}  // namespace

PackedLevel PackLevel(const Scene& scene) {
  const std::optional<LevelCut> cut = CutLevel(scene);
  if (!cut) return {.scene = PackScene(scene), .tiles = {}};
  const Scene rest = SceneWithout(scene, cut->in_tiles);
  packed::ShapeTable shapes(true);  // whole before a tile refers to it
  packed::AddShapesOf(rest, shapes);
  AddShared(*cut, shapes);
  PackedLevel level;
  LevelIndex index{.edge_m = cut->edge_m, .tiles = {}, .shapes = {}};
  for (const auto& [square, tile] : cut->tiles) {
    const std::vector<std::uint8_t>& bytes = level.tiles.emplace_back(PackOn(shapes, tile, scene));
    if (bytes.size() > kMaxTile_bytes) return {.scene = PackScene(scene), .tiles = {}};
    Sha256 sum;
    sum.Add(bytes);
    index.tiles.push_back({square, BoundsOf(tile), bytes.size(), sum.Finish()});
  }
  PackWriter tiles;
  packed::IndexOf(tiles, index);
  level.scene = packed::WriteScene(rest, shapes, kPackedSceneVersion, tiles.Take());
  return level;
}

std::vector<std::uint8_t> PackTile(const Tile& tile, const LevelIndex& index, const Scene& scene) {
  packed::ShapeTable below(true);
  for (const ShapePtr& shape : index.shapes) below.Add(shape);
  return PackOn(below, tile, scene);
}

struct TileUnpacker::Impl {
  Impl(std::span<const std::uint8_t> bytes, const LevelIndex& index, const Scene& scene)
      : content(ContentOf(bytes)),
        shapes(std::span<const ShapePtr>(index.shapes)),
        context{shapes, scene.properties, scene.kinds.size(), scene.layers.size()} {
    if (content.ok()) io.emplace(*content);
  }

  bool ShapesOn(std::size_t bytes) {
    if (!shapes.ReadOn(*io, bytes)) return false;
    left = io->BeginList("parts", 1, kMaxBodies, packed::kMinPartBytes);
    tile->parts.reserve(left);
    return true;
  }
  bool PartsOn(std::size_t bytes) {
    return io->ListOn(tile->parts, left, bytes, [&](TilePart& part) {
      packed::PartOf(*io, part, context);
      if (io->ok() && part.body.id < before) io->Fail("body.id", "does not ascend");
      before = part.body.id;
    });
  }

  absl::StatusOr<std::span<const std::uint8_t>> content;
  packed::ShapeTable shapes;
  packed::Context context;
  std::optional<PackReader> io;
  std::shared_ptr<Tile> tile = std::make_shared<Tile>();
  std::size_t left = 0;
  BodyId before;
  bool has_shapes = false, done = false;
};

TileUnpacker::TileUnpacker(std::span<const std::uint8_t> bytes, const LevelIndex& index, const Scene& scene)
    : impl_(std::make_unique<Impl>(bytes, index, scene)) {}
TileUnpacker::~TileUnpacker() = default;

bool TileUnpacker::Go(std::size_t bytes) {
  Impl& me = *impl_;
  if (!me.io || me.done) return true;
  const std::size_t before = me.io->remaining();
  if (!me.has_shapes) me.has_shapes = me.ShapesOn(bytes);
  const std::size_t read = before - me.io->remaining();
  if (me.has_shapes && me.io->ok() && read < bytes) me.done = me.PartsOn(bytes - read);
  me.done = me.done || !me.io->ok();
  return me.done;
}

absl::StatusOr<std::shared_ptr<const Tile>> TileUnpacker::Take() {
  if (!impl_->content.ok()) return impl_->content.status();
  if (!impl_->io->ok()) return BadTile(impl_->io->error());
  if (impl_->io->remaining() > 0) return BadTile("more bytes follow");
  return std::shared_ptr<const Tile>(std::move(impl_->tile));
}

absl::StatusOr<std::shared_ptr<const Tile>> UnpackTile(std::span<const std::uint8_t> bytes, const LevelIndex& index,
                                                       const Scene& scene) {
  TileUnpacker unpacker(bytes, index, scene);
  while (!unpacker.Go(bytes.size() + 1)) {
  }
  return unpacker.Take();
}

}  // namespace tessera
