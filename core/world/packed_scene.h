// PackScene: a resolved scene in a binary form without protobuf, which regions serve to clients.
//
// It holds all of a Scene, scatters expanded and defaults filled in, so that its reader needs no resolver: a client
// library reads it with nothing but this library. The same scene gives the same bytes (docs/protocol.md, "The packed
// scene"); their SHA-256 names them.
//
//   std::vector<std::uint8_t> packed = PackScene(*scene);
//   absl::StatusOr<std::shared_ptr<const Scene>> same = UnpackScene(packed);   // equal, field by field
//
// A large level can be packed in tiles instead (level_tiles.h), which come one by one: the scene then lacks what is in
// them, and has their list. A small one has none and is packed as by PackScene.
//
//   PackedLevel level = PackLevel(*scene);
//   SceneUnpacker unpacker(level.scene);            // ... and then
//   std::shared_ptr<const LevelIndex> index = unpacker.index();
//   absl::StatusOr<std::shared_ptr<const Tile>> tile = UnpackTile(level.tiles[7], *index, *scene);
//
// Thread rule: pure functions, any thread.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/world/level_tiles.h"
#include "core/world/scene.h"

namespace tessera {

// Versions of the packed form: of a scene in tiles, the newest; of one whose shapes have visuals; of one without any. A
// reader takes all.
inline constexpr std::uint16_t kPackedSceneVersion = 3, kDrawnSceneVersion = 2, kPlainSceneVersion = 1;
inline constexpr std::uint16_t kPackedTileVersion = 1;
// The most that is read, or served: a million bodies take about 30 MB, the largest mesh 40 MB.
inline constexpr std::size_t kMaxPackedSceneBytes = std::size_t{512} << 20;

// `scene` comes from ResolveScene or UnpackScene.
std::vector<std::uint8_t> PackScene(const Scene& scene);

struct PackedLevel {
  std::vector<std::uint8_t> scene;
  std::vector<std::vector<std::uint8_t>> tiles;  // as the scene lists them; none: all is in the scene
};
PackedLevel PackLevel(const Scene& scene);

// Trusts nothing: every number is within the limits of limits.h, every reference leads somewhere, and nothing follows.
// INVALID_ARGUMENT naming the place: "packed scene: bodies[12].mass_kg: 0 is not within ...", "packed scene: of version
// 4; this program reads 1 to 3".
absl::StatusOr<std::shared_ptr<const Scene>> UnpackScene(std::span<const std::uint8_t> bytes);

// Its head alone: that it is one, of this version, with its parts as long as it says. INVALID_ARGUMENT as above.
absl::Status CheckPackedScene(std::span<const std::uint8_t> bytes);

// UnpackScene in goes, for a caller that must not wait for a large one.
//
//   SceneUnpacker unpacker(bytes);
//   while (!unpacker.Go(64 * 1024)) ...               // does other things
//   scene = unpacker.Take();
//
// Thread rule: one thread at a time.
class SceneUnpacker {
 public:
  // `bytes` outlive it.
  explicit SceneUnpacker(std::span<const std::uint8_t> bytes);
  ~SceneUnpacker();
  // Reads on for about `bytes` (> 0): no more than one thing beyond. True once it has come to the end, or failed.
  bool Go(std::size_t bytes);
  // After the end, once: as UnpackScene.
  absl::StatusOr<std::shared_ptr<const Scene>> Take();
  // After the end: the list of its tiles; null if it is not in tiles.
  std::shared_ptr<const LevelIndex> index() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// One tile of the scene whose list `index` is, as PackLevel packs it.
std::vector<std::uint8_t> PackTile(const Tile& tile, const LevelIndex& index, const Scene& scene);

// A tile of the scene whose list `index` is: INVALID_ARGUMENT "packed tile: parts[3].body.id: ...". Whether its bytes
// are those that the list names is the caller's to see.
absl::StatusOr<std::shared_ptr<const Tile>> UnpackTile(std::span<const std::uint8_t> bytes, const LevelIndex& index,
                                                       const Scene& scene);

// UnpackTile in goes, as SceneUnpacker. All that it is given outlives it. Thread rule: one thread at a time.
class TileUnpacker {
 public:
  TileUnpacker(std::span<const std::uint8_t> bytes, const LevelIndex& index, const Scene& scene);
  ~TileUnpacker();
  bool Go(std::size_t bytes);
  absl::StatusOr<std::shared_ptr<const Tile>> Take();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tessera
