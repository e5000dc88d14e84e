// DenseModel: how DenseCodec codes the state of one body, and what it has learnt of states.
#pragma once

#include <vector>

#include "core/replication/codec/dense_codec.h"
#include "core/replication/codec/pose_model.h"

namespace tessera::replication {

// The states that predict one body: those in the frames referred to, null where it was not there, and the ticks from
// the frame to the base, from there to the older one, and on to the oldest.
struct BodyHistory {
  BodyId id;
  const QuantizedState* base = nullptr;
  const QuantizedState* older = nullptr;
  const QuantizedState* oldest = nullptr;
  std::uint64_t ticks = 0, gap = 0, gap2 = 0;
};

class DenseModel {
 public:
  explicit DenseModel(const DenseSetup& setup) : pose_(setup.predictor.orientation_limit()) {}

  void BeginFrame();
  // The state as it is written: without what the setup leaves out.
  static QuantizedState Written(const DenseSetup& setup, const QuantizedState& state);
  // False: beyond all range.
  template <class Coder>
  bool CodeState(Coder& coder, const DenseSetup& setup, const BodyHistory& history, QuantizedState& state);
  // A body that the base does not have; `beside`: the one coded before it, or a default.
  template <class Coder>
  bool CodeArrival(Coder& coder, const DenseSetup& setup, const QuantizedState& beside, QuantizedState& state);

 private:
  template <class Coder>
  bool CodeVelocities(Coder& coder, const QuantizedState& base, QuantizedState& state);
  const Miss* Near(const std::array<std::int64_t, 3>& position) const;
  void Remember(const Prediction& prediction, const QuantizedState& base, const QuantizedState& state,
                std::int32_t limit);

  PoseModel pose_;
  std::array<PlainNumber, 6> velocity_, arrival_velocity_;
  std::array<PlainNumber, 3> arrival_position_, arrival_orientation_;
  std::array<BitModel, 2> arrival_flags_;
  // State that lives for one frame.
  std::vector<Miss> misses_;
  bool moved_ = false;
};

}  // namespace tessera::replication
