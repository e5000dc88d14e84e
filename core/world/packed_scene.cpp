#include "core/world/packed_scene.h"

#include <array>
#include <string_view>

#include "core/world/byte_view.h"
#include "core/world/packed_body.h"
#include "core/world/packed_joint.h"
#include "core/world/packed_rules.h"
#include "core/world/utf8.h"

namespace tessera {
namespace {

using packed::PackReader;
using packed::PackWriter;

constexpr std::string_view kPackedMagic = "TSRS";
// In this order; each once.
constexpr std::array<std::string_view, 4> kChunkIds{"RULE", "SHAP", "BODY", "JOIN"};

template <class Io, class T>
void BodiesOf(Io& io, T& bodies, const packed::Context& context) {
  BodyId before;
  io.List("bodies", bodies, 0, kMaxBodies, packed::kMinBodyBytes, [&](auto& body) {
    packed::BodyOf(io, body, context);
    if constexpr (Io::kReads) {
      if (io.ok() && body.id <= before) io.Fail("id", "does not ascend");
      before = body.id;
    }
  });
}

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

template <class Io, class T, class B>
void JointsOf(Io& io, T& joints, const B& bodies) {
  JointId before;
  io.List("joints", joints, 0, kMaxJoints, packed::kMinJointBytes, [&](auto& joint) {
    packed::JointOf(io, joint);
    if constexpr (Io::kReads) {
      CheckEnds(io, joint, bodies);
      if (io.ok() && joint.id <= before) io.Fail("id", "does not ascend");
      before = joint.id;
    }
  });
}

packed::ShapeTable ShapesOf(const Scene& scene) {
  packed::ShapeTable shapes;
  for (const BodyDef& body : scene.bodies) shapes.Add(body.shape);
  if (scene.player) shapes.Add(scene.player->body.shape);
  for (const Prefab& prefab : scene.prefabs) {
    for (const BodyDef& body : prefab.bodies) shapes.Add(body.shape);
  }
  return shapes;
}

absl::Status BadPack(const std::string& what) {
  return absl::InvalidArgumentError(absl::StrCat("packed scene: ", what));
}

// The chunks in their order, each once.
absl::StatusOr<std::array<std::span<const std::uint8_t>, kChunkIds.size()>> ChunksOf(
    std::span<const std::uint8_t> bytes) {
  if (bytes.size() > kMaxPackedSceneBytes) return BadPack(absl::StrCat("has ", bytes.size(), " bytes"));
  ByteReader in(bytes);
  if (AsText(in.Bytes(kPackedMagic.size())) != kPackedMagic) return BadPack("this is none");
  const std::uint16_t version = in.U16();
  if (!in.ok()) return BadPack("truncated");
  if (version != kPackedSceneVersion) {
    return BadPack(absl::StrCat("of version ", version, "; this program reads ", kPackedSceneVersion));
  }
  std::array<std::span<const std::uint8_t>, kChunkIds.size()> chunks;
  for (std::size_t i = 0; i < kChunkIds.size(); ++i) {
    const std::string id(AsText(in.Bytes(kChunkIds[i].size())));
    const std::uint64_t size = in.U64();
    if (in.ok() && id != kChunkIds[i]) {
      return BadPack(absl::StrCat("chunks[", i, "]: must be ", std::string(kChunkIds[i])));
    }
    if (in.ok() && size > in.remaining()) in.Fail("truncated");
    if (!in.ok()) return BadPack(absl::StrCat(std::string(kChunkIds[i]), ": ", in.error()));
    chunks[i] = in.Bytes(static_cast<std::size_t>(size));
  }
  if (in.remaining() > 0) return BadPack("more bytes follow");
  return chunks;
}

absl::Status Finished(const PackReader& io) {
  if (!io.ok()) return BadPack(io.error());
  return io.remaining() == 0 ? absl::OkStatus() : BadPack("a chunk is longer than what it holds");
}

}  // namespace

std::vector<std::uint8_t> PackScene(const Scene& scene) {
  packed::ShapeTable shapes = ShapesOf(scene);
  const packed::Context context{shapes, scene.properties, scene.kinds.size(), scene.layers.size()};
  std::array<PackWriter, kChunkIds.size()> chunks;
  packed::RulesOf(chunks[0], scene, context);
  shapes.Write(chunks[1]);
  BodiesOf(chunks[2], scene.bodies, context);
  packed::PlayerAndPrefabsOf(chunks[2], scene, context);
  JointsOf(chunks[3], scene.joints, scene.bodies);
  ByteWriter out;
  out.Text(kPackedMagic);
  out.U16(kPackedSceneVersion);
  for (std::size_t i = 0; i < kChunkIds.size(); ++i) {
    const std::vector<std::uint8_t> bytes = chunks[i].Take();
    out.Text(kChunkIds[i]);
    out.U64(bytes.size());
    out.Bytes(bytes);
  }
  return out.Take();
}

absl::StatusOr<std::shared_ptr<const Scene>> UnpackScene(std::span<const std::uint8_t> bytes) {
  const auto chunks = ChunksOf(bytes);
  if (!chunks.ok()) return chunks.status();
  auto scene = std::make_shared<Scene>();
  packed::ShapeTable shapes;

  PackReader rules((*chunks)[0]);
  packed::Context context{shapes, {}, 0, 0};
  packed::RulesOf(rules, *scene, context);
  if (absl::Status status = Finished(rules); !status.ok()) return status;
  context.properties = scene->properties;
  context.kinds = scene->kinds.size();
  context.layers = scene->layers.size();

  PackReader table((*chunks)[1]);
  shapes.Read(table);
  if (absl::Status status = Finished(table); !status.ok()) return status;

  PackReader bodies((*chunks)[2]);
  BodiesOf(bodies, scene->bodies, context);
  packed::PlayerAndPrefabsOf(bodies, *scene, context);
  if (absl::Status status = Finished(bodies); !status.ok()) return status;

  PackReader joints((*chunks)[3]);
  JointsOf(joints, scene->joints, scene->bodies);
  if (absl::Status status = Finished(joints); !status.ok()) return status;
  return scene;
}

}  // namespace tessera
