// Frames of the dense codec: as they come, and under a checksum that is right, so that the rest of the decoder is
// reached. The first byte chooses; the frames they may refer to are of ticks 1 to 8.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <map>

#include "core/replication/codec/checksum.h"
#include "core/replication/codec/dense_codec.h"
#include "core/replication/testing/moving_bodies.h"

namespace {

using namespace tessera;
using namespace tessera::replication;

constexpr std::uint32_t kFingerprint = 7;

struct Stream {
  Stream(DenseCodec codec_in, const Quantizer& quantizer) : codec(std::move(codec_in)) {
    MovingBodies world({.count = 10, .seed = 1});
    DenseCodec::References references;
    for (std::uint64_t n = 1; n <= 8; ++n) {
      world.Step(1.0 / 60);
      DenseFrame frame{.tick = Tick(n), .bodies = {}, .departures = {}};
      for (const BodyRecord& body : world.bodies())
        frame.bodies.push_back({body.id, body.epoch, quantizer.Quantize(body.state)});
      references = {.base = codec.Encode(std::move(frame), references).kept,
                    .older = references.base,
                    .oldest = references.older};
      kept[Tick(n)] = references.base;
    }
  }
  void Try(std::span<const std::uint8_t> bytes) const {
    const auto decoded = codec.Decode(bytes, [&](Tick tick) -> DenseCodec::KeptPtr {
      const auto found = kept.find(tick);
      return found == kept.end() ? nullptr : found->second;
    });
    if (!decoded.ok()) return;
    BodyId previous;
    for (const auto& body : (*decoded)->frame.bodies) {
      if (body.id <= previous) std::abort();
      previous = body.id;
    }
  }
  DenseCodec codec;
  std::map<Tick, DenseCodec::KeptPtr> kept;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Aabb bounds = MovingBodies({.count = 1}).bounds();
  static const Quantizer quantizer(bounds, {});
  // Some of the bodies are known to be boxes, one of them as large as can be.
  static const auto boxes = std::make_shared<const StandingBoxes>(
      StandingBoxes{{BodyId(1), StandingBox::Of(quantizer, 0, {0.5, 0.5, 0.5})},
                    {BodyId(4), StandingBox::Of(quantizer, 1e9, {0.2, 0, 3})},
                    {BodyId(7), StandingBox::Of(quantizer, -1e9, {1e9, 1e9, 1e9})}});
  static const Stream dense(
      DenseCodec({.predictor = PosePredictor(quantizer, {}, -9.81), .boxes = boxes, .fingerprint = kFingerprint}),
      quantizer);
  if (size == 0) return 0;
  Bytes bytes(data + 1, data + size);
  if ((data[0] & 2) != 0) {
    const std::uint32_t checksum = Crc32c(bytes, kFingerprint);
    for (int i = 0; i < 4; ++i) bytes.push_back(static_cast<std::uint8_t>(checksum >> (8 * i)));
  }
  dense.Try(bytes);
  return 0;
}
