// DenseCodec: whole ticks of a region, quantised, in as few bytes as possible: for recordings and thin links.
//
//   const DenseCodec codec = MakeDenseCodec(bounds, settings, gravity);
//   auto sent = codec.Encode(frame, {.base = acked, .older = ..., .oldest = ...});
//   send(sent.bytes);                                                    // and keep sent.kept until it is acknowledged
//   ...
//   auto kept = codec.Decode(bytes, [&](Tick tick) { return kept_at(tick); });
//   use((*kept)->frame);
//
// A frame is coded against one that both ends have, `base`: its states predict the new ones, together with those of two
// older frames where given, and the coder goes on learning from what it had learnt by then. So frames against the one
// before make a gap-free log, frames against the last acknowledged one survive any loss, and a frame without a base
// starts afresh. The same bytes come from the same frames on every host: all predictions are in integers.
//
// Nothing in the bytes is trusted. They end in a checksum, so damage is found; malformed bytes that pass it are an
// error that names the fault, and never make the decoder read out of bounds or loop for long.
// Thread rule: const; any thread.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/replication/codec/predict.h"
#include "core/replication/codec/standing_box.h"
#include "core/replication/quantize.h"
#include "core/replication/snapshot_record.h"
#include "core/replication/snapshot_settings.h"

namespace tessera::replication {

struct DenseBody {
  BodyId id;
  Epoch epoch;
  QuantizedState state;
  friend bool operator==(const DenseBody&, const DenseBody&) = default;
};

struct DenseFrame {
  Tick tick;
  std::vector<DenseBody> bodies;            // ascending by id
  std::vector<DepartureRecord> departures;  // since the base; ascending by id
};

// Setup that both ends share; frames of another one are refused by their fingerprint.
struct DenseSetup {
  PosePredictor predictor;
  std::shared_ptr<const StandingBoxes> boxes = nullptr;  // null: none are known
  bool velocities = true;                                // false: velocities are left out, and come out as 0
  std::uint32_t fingerprint = 0;
};

class DenseCodec {
 public:
  struct Learnt;  // the coder's state after a frame, about 700 kB

  // A frame as both ends have it, and how the coder goes on from it.
  struct Kept {
    DenseFrame frame;
    std::shared_ptr<const Learnt> learnt;
  };
  using KeptPtr = std::shared_ptr<const Kept>;
  // Frames that a new one refers to: each is older than the one before, `base` is older than the new frame. Null where
  // there is none; `older` requires `base`, `oldest` requires `older`.
  struct References {
    KeptPtr base, older, oldest;
  };
  struct Encoded {
    Bytes bytes;
    KeptPtr kept;
  };
  using Lookup = std::function<KeptPtr(Tick)>;  // null: not here

  explicit DenseCodec(DenseSetup setup) : setup_(std::move(setup)) {}

  Encoded Encode(DenseFrame frame, const References& references) const;
  // Errors: INVALID_ARGUMENT (names the fault), FAILED_PRECONDITION (a frame it refers to is not here).
  absl::StatusOr<KeptPtr> Decode(std::span<const std::uint8_t> bytes, const Lookup& lookup) const;

 private:
  DenseSetup setup_;
};

// `gravity_m_s2` acts along y. `velocities` false: poses and sleep alone, for watchers that derive velocities. `boxes`:
// the boxes that both ends know to stand on a floor.
DenseCodec MakeDenseCodec(const Aabb& world_bounds, const SnapshotSettings& settings, double gravity_m_s2,
                          bool velocities = true, std::shared_ptr<const StandingBoxes> boxes = nullptr);

}  // namespace tessera::replication
