// DenseModel: how FrameCodec codes quantised states; DenseCodec is the codec with it.
#pragma once

#include "core/replication/codec/frame_codec.h"
#include "core/replication/codec/pose_model.h"

namespace tessera::replication {

class DenseModel {
 public:
  using State = QuantizedState;
  struct Setup {
    PosePredictor predictor;
    std::shared_ptr<const StandingBoxes> boxes = nullptr;  // null: none are known
    bool velocities = true;                                // false: velocities are not told, and come out as 0
    std::uint32_t fingerprint = 0;
    std::uint8_t format = 1;
  };

  explicit DenseModel(const Setup& setup) : pose_(setup.predictor.orientation_limit()) {}

  void BeginFrame();
  // As it is told: what the setup leaves out is gone.
  static State Told(const Setup& setup, const State& state);
  // False: beyond all range.
  template <class Coder>
  bool CodeState(Coder& coder, const Setup& setup, const BodyHistory<State>& history, State& state);
  // A body that the base does not have; `beside`: the one told before it, or a default.
  template <class Coder>
  bool CodeArrival(Coder& coder, const Setup& setup, const State& beside, State& state);

 private:
  template <class Coder>
  bool CodeVelocities(Coder& coder, const State& base, State& state);
  const Miss* Near(const std::array<std::int64_t, 3>& position) const;
  void Remember(const Prediction& prediction, const State& base, const State& state, std::int32_t limit);

  PoseModel pose_;
  std::array<PlainNumber, 6> velocity_, arrival_velocity_;
  std::array<PlainNumber, 3> arrival_position_, arrival_orientation_;
  std::array<BitModel, 2> arrival_flags_;
  // Of this frame:
  std::vector<Miss> misses_;
  bool moved_ = false;
};

using DenseCodec = FrameCodec<DenseModel>;

// `velocities` false: poses and sleep alone, for watchers that derive velocities. `gravity_m_s2` along y. `boxes`: what
// both ends know of bodies that stand on a floor.
DenseCodec MakeDenseCodec(const Aabb& world_bounds, const Settings& settings, double gravity_m_s2,
                          bool velocities = true, std::shared_ptr<const StandingBoxes> boxes = nullptr);

}  // namespace tessera::replication
