#include "core/world/packed_scene.h"

#include <algorithm>
#include <array>
#include <functional>
#include <optional>
#include <string_view>
#include <utility>

#include "core/world/byte_view.h"
#include "core/world/packed_body.h"
#include "core/world/packed_joint.h"
#include "core/world/packed_level.h"
#include "core/world/packed_rules.h"
#include "core/world/utf8.h"

namespace tessera {
namespace {

using packed::PackReader;
using packed::PackWriter;

constexpr std::string_view kPackedMagic = "TSRS";
// In this order; each once, the last only of a scene in tiles.
constexpr std::array<std::string_view, 5> kChunkIds{"RULE", "SHAP", "BODY", "JOIN", "TILE"};
std::size_t ChunksIn(std::uint16_t version) { return version == kPackedSceneVersion ? 5 : 4; }

// Null if there is no such body.
const BodyDef* FindBody(const std::vector<BodyDef>& bodies, BodyId id) {
  const auto it = std::ranges::lower_bound(bodies, id, {}, &BodyDef::id);
  return it != bodies.end() && it->id == id ? &*it : nullptr;
}

// The ends of a joint are there, and one of them moves.
void CheckEnds(PackReader& io, const JointDef& joint, const std::vector<BodyDef>& bodies) {
  if (!io.ok()) return;
  const BodyDef *a = FindBody(bodies, joint.body_a), *b = FindBody(bodies, joint.body_b);
  if (a == nullptr) return io.Fail("body_a", "there is no such body");
  if (b == nullptr && joint.body_b != BodyId()) return io.Fail("body_b", "there is no such body");
  if (a->motion == Motion::kStatic && (b == nullptr || b->motion == Motion::kStatic)) io.Fail("body_a", "is static");
}

// Calls `each` with the shape of every body, the player's and those of prefabs too.
void ForEachShape(const Scene& scene, const std::function<void(const ShapePtr&)>& each) {
  for (const BodyDef& body : scene.bodies) each(body.shape);
  if (scene.player) each(scene.player->body.shape);
  for (const Prefab& prefab : scene.prefabs) {
    for (const BodyDef& body : prefab.bodies) each(body.shape);
  }
}

bool HasVisuals(const Scene& scene) {
  bool found = false;
  ForEachShape(scene, [&](const ShapePtr& shape) { found = found || !shape->visuals.empty(); });
  return found;
}

absl::Status BadPack(const std::string& what) {
  return absl::InvalidArgumentError(absl::StrCat("packed scene: ", what));
}

// The chunks in their order, each once.
struct Chunks {
  std::uint16_t version = 0;
  std::array<std::span<const std::uint8_t>, kChunkIds.size()> bytes;
};

absl::StatusOr<Chunks> ChunksOf(std::span<const std::uint8_t> bytes) {
  if (bytes.size() > kMaxPackedSceneBytes) return BadPack(absl::StrCat("has ", bytes.size(), " bytes"));
  ByteReader in(bytes);
  if (AsText(in.Bytes(kPackedMagic.size())) != kPackedMagic) return BadPack("this is none");
  const std::uint16_t version = in.U16();
  if (!in.ok()) return BadPack("truncated");
  if (version < kPlainSceneVersion || version > kPackedSceneVersion) {
    return BadPack(
        absl::StrCat("of version ", version, "; this program reads ", kPlainSceneVersion, " to ", kPackedSceneVersion));
  }
  Chunks chunks{version, {}};
  for (std::size_t i = 0; i < ChunksIn(version); ++i) {
    const std::string id(AsText(in.Bytes(kChunkIds[i].size())));
    const std::uint64_t size = in.U64();
    if (in.ok() && id != kChunkIds[i]) {
      return BadPack(absl::StrCat("chunks[", i, "]: must be ", std::string(kChunkIds[i])));
    }
    if (in.ok() && size > in.remaining()) in.Fail("truncated");
    if (!in.ok()) return BadPack(absl::StrCat(std::string(kChunkIds[i]), ": ", in.error()));
    chunks.bytes[i] = in.Bytes(static_cast<std::size_t>(size));
  }
  if (in.remaining() > 0) return BadPack("more bytes follow");
  return chunks;
}

absl::Status Finished(const PackReader& io) {
  if (!io.ok()) return BadPack(io.error());
  return io.remaining() == 0 ? absl::OkStatus() : BadPack("a chunk is longer than what it holds");
}

}  // namespace

void packed::AddShapesOf(const Scene& scene, ShapeTable& shapes) {
  ForEachShape(scene, [&](const ShapePtr& shape) { shapes.Add(shape); });
}

std::vector<std::uint8_t> packed::WriteScene(const Scene& scene, ShapeTable& shapes, std::uint16_t version,
                                             std::vector<std::uint8_t> tiles) {
  AddShapesOf(scene, shapes);
  const packed::Context context{shapes, scene.properties, scene.kinds.size(), scene.layers.size()};
  std::array<PackWriter, kChunkIds.size()> chunks;
  packed::RulesOf(chunks[0], scene, context);
  shapes.Write(chunks[1]);
  chunks[2].List("bodies", scene.bodies, 0, kMaxBodies, packed::kMinBodyBytes,
                 [&](const BodyDef& body) { packed::BodyOf(chunks[2], body, context); });
  packed::PlayerAndPrefabsOf(chunks[2], scene, context);
  chunks[3].List("joints", scene.joints, 0, kMaxJoints, packed::kMinJointBytes,
                 [&](const JointDef& joint) { packed::JointOf(chunks[3], joint); });
  chunks[4].Raw(tiles);
  ByteWriter out;
  out.Text(kPackedMagic);
  out.U16(version);
  for (std::size_t i = 0; i < ChunksIn(version); ++i) {
    const std::vector<std::uint8_t> bytes = chunks[i].Take();
    out.Text(kChunkIds[i]);
    out.U64(bytes.size());
    out.Bytes(bytes);
  }
  return out.Take();
}

std::vector<std::uint8_t> PackScene(const Scene& scene) {
  const bool visuals = HasVisuals(scene);
  packed::ShapeTable shapes(visuals);
  return packed::WriteScene(scene, shapes, visuals ? kDrawnSceneVersion : kPlainSceneVersion, {});
}

// The chunks one after the other; `left` and the ids before belong to the list under way.
struct SceneUnpacker::Impl {
  explicit Impl(std::span<const std::uint8_t> bytes)
      : chunks(ChunksOf(bytes)), shapes(chunks.ok() && chunks->version > kPlainSceneVersion) {
    if (!chunks.ok()) status = chunks.status();
  }

  void Enter(std::size_t chunk) {
    io.emplace(chunks->bytes[chunk]);
    at = chunk;
  }
  void Leave() { status = Finished(*io); }
  void ReadRules() {
    Enter(0);
    packed::RulesOf(*io, *scene, context);
    context.properties = scene->properties;
    context.kinds = scene->kinds.size();
    context.layers = scene->layers.size();
    Leave();
  }
  bool BodiesOn(std::size_t bytes) {
    return io->ListOn(scene->bodies, left, bytes, [&](BodyDef& body) {
      packed::BodyOf(*io, body, context);
      if (io->ok() && body.id <= body_before) io->Fail("id", "does not ascend");
      body_before = body.id;
    });
  }
  bool JointsOn(std::size_t bytes) {
    return io->ListOn(scene->joints, left, bytes, [&](JointDef& joint) {
      packed::JointOf(*io, joint);
      CheckEnds(*io, joint, scene->bodies);
      if (io->ok() && joint.id <= joint_before) io->Fail("id", "does not ascend");
      joint_before = joint.id;
    });
  }
  void BeginBodies() {
    Enter(2);
    left = io->BeginList("bodies", 0, kMaxBodies, packed::kMinBodyBytes);
    scene->bodies.reserve(left);
  }
  void EndBodies() {
    packed::PlayerAndPrefabsOf(*io, *scene, context);
    Leave();
    if (!status.ok()) return;
    Enter(3);
    left = io->BeginList("joints", 0, kMaxJoints, packed::kMinJointBytes);
    scene->joints.reserve(left);
  }
  // One go at the chunk under way.
  void On(std::size_t bytes) {
    if (!io) {
      ReadRules();
      if (status.ok()) Enter(1);
    } else if (at == 1) {
      if (!shapes.ReadOn(*io, bytes)) return;
      Leave();
      if (status.ok()) BeginBodies();
    } else if (at == 2) {
      if (BodiesOn(bytes)) EndBodies();
    } else if (at == 3) {
      if (!JointsOn(bytes)) return;
      Leave();
      done = status.ok() && chunks->version != kPackedSceneVersion;
      if (status.ok() && !done) Enter(4);
    } else {
      ReadIndex();
    }
  }
  void ReadIndex() {
    index = std::make_shared<LevelIndex>();
    packed::IndexOf(*io, *index);
    Leave();
    index->shapes = shapes.TakeShapes();
    done = true;
  }
  std::size_t Remaining() const { return io ? io->remaining() : 0; }

  absl::StatusOr<Chunks> chunks;
  absl::Status status;
  std::shared_ptr<Scene> scene = std::make_shared<Scene>();
  std::shared_ptr<LevelIndex> index;
  packed::ShapeTable shapes;
  packed::Context context{shapes, {}, 0, 0};
  std::optional<PackReader> io;
  std::size_t at = 0, left = 0;
  BodyId body_before;
  JointId joint_before;
  bool done = false;
};

SceneUnpacker::SceneUnpacker(std::span<const std::uint8_t> bytes) : impl_(std::make_unique<Impl>(bytes)) {}
SceneUnpacker::~SceneUnpacker() = default;

bool SceneUnpacker::Go(std::size_t bytes) {
  Impl& me = *impl_;
  while (me.status.ok() && !me.done) {
    const std::size_t chunk = me.at, before = me.Remaining();
    me.On(bytes);
    if (me.at != chunk || !me.io) continue;
    const std::size_t read = before - me.Remaining();
    if (read >= bytes) break;
    bytes -= read;
  }
  return !me.status.ok() || me.done;
}

absl::StatusOr<std::shared_ptr<const Scene>> SceneUnpacker::Take() {
  if (!impl_->status.ok()) return impl_->status;
  return std::shared_ptr<const Scene>(std::move(impl_->scene));
}

std::shared_ptr<const LevelIndex> SceneUnpacker::index() const { return impl_->index; }

absl::Status CheckPackedScene(std::span<const std::uint8_t> bytes) { return ChunksOf(bytes).status(); }

absl::StatusOr<std::shared_ptr<const Scene>> UnpackScene(std::span<const std::uint8_t> bytes) {
  SceneUnpacker unpacker(bytes);
  while (!unpacker.Go(bytes.size() + 1)) {
  }
  return unpacker.Take();
}

}  // namespace tessera
