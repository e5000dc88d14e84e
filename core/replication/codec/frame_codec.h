// FrameCodec: whole ticks of a region in few bytes, for recordings, thin links and the log that heirs follow.
//
//   const auto codec = MakeDenseCodec(bounds, settings, gravity);        // quantised, or
//   const LosslessCodec codec;                                           // every bit of every state
//   auto sent = codec.Encode(frame, {.base = acked, .older = ..., .oldest = ...});
//   send(sent.bytes);                                                    // and keep sent.kept until it is acknowledged
//   ...
//   auto kept = codec.Decode(bytes, [&](Tick tick) { return kept_at(tick); });
//   use((*kept)->frame);
//
// A frame is coded against one that both ends have, `base`: its states predict the new ones, together with those of two
// older frames where given, and what the coder had learnt by then is where it goes on learning. So frames against the
// one before make a gap-free log, frames against the last acknowledged one survive any loss, and a frame without a base
// starts afresh. The same bytes come from the same frames on every host: all predictions are whole numbers.
//
// Nothing in the bytes is trusted. They end in a checksum, so damage is found; what passes it and is malformed still is
// an error that names what was wrong, and never reads out of bounds or loops for long.
// Thread rule: const; any thread.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "absl/status/statusor.h"
#include "core/replication/quantize.h"
#include "core/replication/snapshot.h"

namespace tessera::replication {

template <class State>
struct FrameBody {
  BodyId id;
  Epoch epoch;
  State state;
  friend bool operator==(const FrameBody&, const FrameBody&) = default;
};

template <class State>
struct Frame {
  Tick tick;
  std::vector<FrameBody<State>> bodies;     // ascending by id
  std::vector<DepartureRecord> departures;  // ascending by id; since the base
};

// What predicts one body: its states in the frames referred to, null where it was not there, and the ticks from the
// frame to the base, from there to the older one, and on to the oldest.
template <class State>
struct BodyHistory {
  BodyId id;
  const State* base = nullptr;
  const State* older = nullptr;
  const State* oldest = nullptr;
  std::uint64_t ticks = 0, gap = 0, gap2 = 0;
};

namespace frame_codec_detail {
template <class Model>
struct Learnt;
}

// `Model` says how one state is coded and what is learnt: dense_model.h, lossless_model.h.
template <class Model>
class FrameCodec {
 public:
  using State = typename Model::State;

  // A frame as both ends have it, with what the coder knew after it. About 700 kB for the dense model.
  struct Kept {
    Frame<State> frame;
    std::shared_ptr<const frame_codec_detail::Learnt<Model>> learnt;
  };
  using KeptPtr = std::shared_ptr<const Kept>;
  // All older than the frame, each older than the one before; `older` and `oldest` may be null, and all may.
  struct References {
    KeptPtr base, older, oldest;
  };
  struct Encoded {
    Bytes bytes;
    KeptPtr kept;
  };
  using Lookup = std::function<KeptPtr(Tick)>;  // null: not here

  explicit FrameCodec(typename Model::Setup setup);

  Encoded Encode(Frame<State> frame, const References& references) const;
  // Errors: INVALID_ARGUMENT (names what), FAILED_PRECONDITION (a frame it refers to is not here).
  absl::StatusOr<KeptPtr> Decode(std::span<const std::uint8_t> bytes, const Lookup& lookup) const;

 private:
  typename Model::Setup setup_;
};

}  // namespace tessera::replication
