// Link: one border in step with a neighbour: which of its frames goes with which step, which need not come, and how the
// border closes and opens again.
//
// Frames of an open border are numbered from 0, and both sides send number n after the same step; so the number n of
// the neighbour is what the step after the own number n needs. Ticks are labels of these steps: who is behind adopts
// the later one.
//
// A frame may vouch for the next few: they are like this one, with nothing but sleepers, and do not come. That ends
// when the other side says something new: what follows its frame n, if that vouches for nothing, comes again.
//
// A border that this side closed, or heard the other close, sends offers until both know of all closings. Who is far
// behind adopts the other's tick. Then the higher region says at which tick it opens, and both send their frame 0 at
// that tick: so a border opens between the same steps that other ways between the two regions connect, as long as
// neither adopts a tick in between. docs/protocol.md has the state machine.
//
//   if (link.Ready()) frame = link.Take();
//   if (link.DutyNow() == Link::Duty::kFrame) send(Encode(frame with link.Stamp(vouch), ...));
//
// Thread rule: one thread at a time.
#pragma once

#include <deque>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "core/region/catalog.h"
#include "core/region/frame.h"

namespace tessera::region {

class Link {
 public:
  enum class Duty { kNothing, kOffer, kFirstFrame, kFrame };

  Link(RegionId self, RegionId peer) : self_(self), peer_(peer) {}

  RegionId peer() const { return peer_; }
  bool open() const { return open_; }

  // `header` is that of `bytes`, which are the peer's; `now` is the receiver's tick. On success `taken` is the frame
  // that was added, if one was: what is here already, or of a border that has closed since, is passed over.
  absl::Status Put(const FrameHeader& header, std::span<const std::uint8_t> bytes, const Catalog& catalog, Tick now,
                   const Frame** taken);
  // Takes back the frame that the last Put added.
  void Reject();

  // The frame that the next step needs is here or vouched for, or the border is closed.
  bool Ready() const;
  // Requires Ready(). `now`: the tick before the step. Of a closed border: a frame without sender, whose tick is one to
  // adopt if this side is far behind.
  Frame Take(Tick now);

  // What is to be sent after the step to `now`. Ask once; then Stamp what is sent.
  Duty DutyNow(Tick now);
  // Whether the frame after this step will be sent, so that something may be put into it.
  bool Speaks() const { return open_ && stamp_.number >= silent_end_; }
  FrameStamp StampFrame(std::uint32_t vouched);
  FrameStamp StampOffer() const;

  // The neighbour is silent: from now on nobody waits for it.
  void Close();
  // This side adopted a later tick, so a tick agreed before names another step now: what was agreed of opening is void,
  // and agreed anew.
  void Jumped();

 private:
  void Forget();
  void CloseAnew();
  void TakeOffer(const FrameHeader& header, Tick now);
  absl::Status PutFrame(const FrameHeader& header, std::span<const std::uint8_t> bytes, const Catalog& catalog,
                        Tick now, const Frame** taken);
  Frame Vouched(std::uint64_t number, const std::vector<GhostRecord>& ghosts) const;
  // The number of the first frame that is not vouched for, by what came last and what was sent since.
  std::uint64_t ComesNext() const;

  RegionId self_, peer_;
  bool open_ = true;
  Tick open_at_;                // agreed; 0: not yet
  Tick adopt_;                  // of an offer, if this side is far behind
  std::uint32_t offers_ = 0;    // that came since this side opened, while the other has not
  std::uint32_t strain_ = 0;    // of frames with another tick, kStrain each, less one for each with the right one
  std::uint32_t offer_in_ = 0;  // steps
  FrameStamp stamp_;            // closings of both; number of the next own frame

  std::uint64_t here_ = 0;     // frames that came or were vouched for up to the newest that came: its number + 1
  std::uint64_t needed_ = 0;   // number of the frame that the next step needs
  std::uint32_t vouched_ = 0;  // by the newest frame
  Tick newest_;                // its label
  std::deque<Frame> frames_;   // not yet taken
  std::vector<GhostRecord> previous_, before_previous_;  // ghosts of the newest frame, and of the one before it
  FrameStamp before_;                                    // what Reject needs: of the frame before
  Tick before_newest_;

  std::deque<std::uint64_t> news_;  // numbers of own frames that vouched for nothing, since here_ - 1
  std::uint64_t silent_end_ = 0;    // own frames before this number are vouched for
};

}  // namespace tessera::region
