// PackScene: a resolved scene in a binary form without protobuf, which regions serve to clients.
//
// It holds all of a Scene, scatters expanded and defaults filled in, so that its reader needs no resolver: a client
// library reads it with nothing but this library. The same scene gives the same bytes (docs/protocol.md, "The packed
// scene"); their SHA-256 names them. The form is a list of chunks with ids, so that a later version can add tiles of a
// world that come one by one.
//
//   std::vector<std::uint8_t> packed = PackScene(*scene);
//   absl::StatusOr<std::shared_ptr<const Scene>> same = UnpackScene(packed);   // equal, field by field
//
// Thread rule: pure functions, any thread.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/world/scene.h"

namespace tessera {

// Newest version of the packed form, in which shapes have visuals, and the one of a scene without any. A reader takes
// both.
inline constexpr std::uint16_t kPackedSceneVersion = 2, kPlainSceneVersion = 1;
// The most that is read, or served: a million bodies take about 30 MB, the largest mesh 40 MB.
inline constexpr std::size_t kMaxPackedSceneBytes = std::size_t{512} << 20;

// `scene` comes from ResolveScene or UnpackScene.
std::vector<std::uint8_t> PackScene(const Scene& scene);

// Trusts nothing: every number is within the limits of limits.h, every reference leads somewhere, and nothing follows.
// INVALID_ARGUMENT naming the place: "packed scene: bodies[12].mass_kg: 0 is not within ...", "packed scene: of version
// 3; this program reads 1 and 2".
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

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tessera
