// BorderLink: one border in step with a neighbour: which of its frames goes with which step, which need not come, and
// how the link goes down and comes up again.
//
// While the link is up, frames are numbered from 0, and both sides send number n after the same step; so the step
// after the own number n needs the neighbour's number n. Ticks are labels of these steps: the side that is behind
// adopts the later one.
//
// A frame may promise the next few: they are like this one, with nothing but sleepers, and do not come. The promise
// ends when the other side sends something new: what follows its frame n, if that promises nothing, comes again.
//
// A side whose link is down, because it took the link down or heard that the other did, sends requests to reconnect
// until both know of all outages. Who is far behind adopts the other's tick. Then the higher region names a tick, and
// both send their frame 0 at that tick: so a link comes up between the same steps that other ways between the two
// regions connect, as long as neither adopts a tick in between. docs/protocol.md has the state machine.
//
//   if (link.Ready()) frame = link.Take(now);
//   if (link.DutyNow(now) == BorderLink::Duty::kFrame) send(Encode(frame with link.StampFrame(promised), ...));
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

class BorderLink {
 public:
  enum class Duty { kNothing, kReconnect, kFirstFrame, kFrame };

  BorderLink(RegionId self, RegionId peer) : self_(self), peer_(peer) {}

  RegionId peer() const { return peer_; }
  bool up() const { return up_; }
  // Tick of the newest frame that came; 0: none since the link is up, or it is down.
  Tick newest() const { return up_ && here_ > 0 ? newest_ : Tick(); }

  // `header` is that of `bytes`, which are the peer's; `now` is the receiver's tick. On success `taken` is the frame
  // that was added, if one was: a frame that is here already, or from before an outage, is passed over.
  absl::Status Put(const BorderFrameHeader& header, std::span<const std::uint8_t> bytes, const Catalog& catalog,
                   Tick now, const BorderFrame** taken);
  // Takes back the frame that the last Put added.
  void Reject();

  // The frame that the next step needs is here or promised, or the link is down.
  bool Ready() const;
  // Requires Ready(). `now` is the tick before the step. While the link is down it gives a frame without sender, whose
  // tick is one to adopt if this side is far behind.
  BorderFrame Take(Tick now);

  // The kind of message that has to be sent after the step to `now`. Ask once in a step, then stamp what is sent.
  Duty DutyNow(Tick now);
  // Whether the frame after this step will be sent, so that something may be put into it.
  bool Speaks() const { return up_ && stamp_.number >= silent_end_; }
  FrameStamp StampFrame(std::uint32_t promised);
  FrameStamp StampReconnect() const;

  // The neighbour is silent: from now on nobody waits for it.
  void TakeDown();
  // This side adopted a later tick, so a tick that was agreed on names another step now: both agree on another.
  void Jumped();

  void Validate() const;

 private:
  void Forget();
  void CountOutage();
  void TakeReconnect(const BorderFrameHeader& header, Tick now);
  absl::Status PutFrame(const BorderFrameHeader& header, std::span<const std::uint8_t> bytes, const Catalog& catalog,
                        Tick now, const BorderFrame** taken);
  BorderFrame Promised(std::uint64_t number, const std::vector<GhostRecord>& ghosts) const;
  // Number of the first frame that is not promised, by the frame that came last and those that were sent since.
  std::uint64_t ComesNext() const;

  RegionId self_, peer_;
  bool up_ = true;
  Tick up_at_;                      // agreed tick of the first frames; 0: none yet
  Tick adopt_;                      // tick of a reconnect request, if this side is far behind it
  std::uint32_t reconnects_ = 0;    // requests that came since this side is up, while the other is not
  std::uint32_t desync_score_ = 0;  // grows by kDesyncPenalty with each frame of another tick, else falls by one
  std::uint32_t reconnect_in_ = 0;  // steps until the next request
  FrameStamp stamp_;                // outages of both sides; number of the next own frame

  std::uint64_t here_ = 0;          // frames that came or were promised up to the newest that came: its number + 1
  std::uint64_t needed_ = 0;        // number of the frame that the next step needs
  std::uint32_t promised_ = 0;      // by the newest frame
  Tick newest_;                     // label of the newest frame
  std::deque<BorderFrame> frames_;  // not yet taken
  std::vector<GhostRecord> previous_, before_previous_;  // ghosts of the newest frame, and of the one before it
  FrameStamp before_;                                    // the frame before, for Reject
  Tick before_newest_;

  std::deque<std::uint64_t> news_;  // numbers of own frames that promised nothing, since here_ - 1
  std::uint64_t silent_end_ = 0;    // own frames before this number are promised
};

}  // namespace tessera::region
