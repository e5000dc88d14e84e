// LosslessModel: how FrameCodec codes states to the last bit; LosslessCodec is the codec with it, for the log that
// heirs and checkpoints follow: what comes out is what went in, NaNs and minus zeros included.
//
// Numbers are told by their IEEE bits, put in order as whole numbers (so neighbours in value are neighbours in number),
// less those of the base; positions and orientations less what two frames back predict as well.
#pragma once

#include "core/replication/codec/frame_codec.h"
#include "core/replication/codec/number_model.h"

namespace tessera::replication {

class LosslessModel {
 public:
  using State = BodyState;
  struct Setup {
    std::uint32_t fingerprint = 0;
    std::uint8_t format = 2;
  };

  explicit LosslessModel(const Setup&) {}

  void BeginFrame() { moved_ = false; }
  static State Told(const Setup&, const State& state) { return state; }
  template <class Coder>
  bool CodeState(Coder& coder, const Setup& setup, const BodyHistory<State>& history, State& state);
  template <class Coder>
  bool CodeArrival(Coder& coder, const Setup& setup, const State& beside, State& state);

 private:
  // A 64-bit word: its length by a tree, then as in number_model.h.
  struct WordModel {
    std::array<BitModel, 128> length;
    std::array<BitModel, 65> sign;
    std::array<std::array<BitModel, 3>, 65> top;
  };
  static constexpr std::size_t kWords = 17;  // position 3, orientation 4, velocities 6, momentum 3, still time 1
  using Words = std::array<std::int64_t, kWords>;

  static Words ToWords(const State& state);
  static State FromWords(const Words& words, bool asleep);
  template <class Coder>
  static void CodeWord(Coder& coder, std::int64_t& value, WordModel& model);
  template <class Coder>
  void CodeWords(Coder& coder, const Words& predicted, std::array<WordModel, kWords>& models, Words& words);

  std::array<WordModel, kWords> change_, arrival_;
  std::array<BitModel, 2> asleep_;
  std::array<BitModel, 4> same_;
  bool moved_ = false;
};

using LosslessCodec = FrameCodec<LosslessModel>;

}  // namespace tessera::replication
