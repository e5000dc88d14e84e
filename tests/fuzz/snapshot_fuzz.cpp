// Snapshot datagrams to a receiver that knows some bodies, their acknowledgements to a sender, fast lists, and news of
// movements.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "core/replication/codec/fast_list.h"
#include "core/replication/codec/velocity.h"
#include "core/replication/movement_news.h"
#include "core/replication/quantize.h"
#include "core/replication/snapshot.h"
#include "core/replication/testing/moving_bodies.h"
#include "core/world/math.h"

namespace {

using namespace tessera;
using namespace tessera::replication;

void ReadFastList(std::span<const std::uint8_t> bytes, const Quantizer& quantizer) {
  static const PosePredictor predictor(quantizer, {}, -9.81);
  static const VelocityEstimator velocities({});
  static const QuantizedState base{.position = {100, 200, 300}}, older{.position = {90, 210, 300}};
  BitReader reader(bytes);
  FastListReader list(reader);
  BodyId id, previous;
  SampleTicks samples;
  while (list.Next(id, samples)) {
    if (id <= previous || samples.ticks == 0) std::abort();
    previous = id;
    QuantizedState state;
    const Prediction prediction = predictor.Predict({.base = &base,
                                                     .older = samples.gap != 0 ? &older : nullptr,
                                                     .oldest = samples.gap2 != 0 ? &base : nullptr,
                                                     .ticks = samples.ticks,
                                                     .gap = samples.gap,
                                                     .gap2 = samples.gap2});
    if (!ReadPose(reader, prediction, base, quantizer.orientation_limit(), state)) return;
    if (list.has_velocities() && !state.asleep) {
      const VelocityEstimate estimate =
          velocities.From(base, state, prediction, samples.ticks, quantizer.orientation_limit());
      if (!ReadVelocities(reader, estimate, state)) return;
    }
    for (std::size_t i = 0; i < 3; ++i) {
      if (std::abs(state.linear[i]) > kMaxVelocity || std::abs(state.angular[i]) > kMaxVelocity) std::abort();
    }
    for (const std::int64_t c : state.position) {
      if (c < -kMaxPosition || c > kMaxPosition) std::abort();
    }
  }
}

// Refused, or it says the same when it is written again.
void ReadMovement(std::span<const std::uint8_t> bytes) {
  const auto news = DecodeMovementNews(bytes);
  if (!news.ok()) return;
  const auto again = DecodeMovementNews(EncodeMovementNews(*news));
  if (!again.ok() || *again != *news) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::span<const std::uint8_t> bytes(data + 1, size - 1);
  ReadMovement(bytes);
  MovingBodies world({.count = 6});
  world.bodies()[2].properties = std::make_shared<const Bytes>(Bytes{0, 7});
  static const Quantizer quantizer(world.bounds(), {});
  if (data[0] % 3 == 0) {
    ReadFastList(bytes, quantizer);
    return 0;
  }
  SnapshotHistory history(world.bounds(), {});
  SnapshotSender sender({});
  SnapshotReceiver receiver(world.bounds(), {});
  for (std::uint64_t n = 1; n <= 3; ++n) {
    world.Step(1.0 / 30);
    history.Push(Tick(2 * n), world.bodies(), {});
    for (const Bytes& datagram : sender.Write(history, 0, 0).datagrams) {
      if (!receiver.Read(datagram).ok()) std::abort();
    }
    if (!sender.Acknowledge(receiver.WriteAck()).ok()) std::abort();
  }
  if (data[0] % 3 == 1) {
    (void)sender.Acknowledge(bytes);
    (void)sender.Write(history, 0, 0);
    return 0;
  }
  // Past kind and fingerprint, which noise would hardly meet.
  Bytes datagram{1, static_cast<std::uint8_t>(quantizer.fingerprint()),
                 static_cast<std::uint8_t>(quantizer.fingerprint() >> 8)};
  datagram.insert(datagram.end(), bytes.begin(), bytes.end());
  const auto got = receiver.Read(datagram);
  if (!got.ok()) return 0;
  for (const BodyRecord& body : got->bodies) {
    if (!IsFinite(body.state.position) || !IsFinite(body.state.orientation)) std::abort();
  }
  return 0;
}
