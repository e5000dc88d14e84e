// Borders: the links with all neighbours and the frames on them, checked and in order.
//
// Nothing in a frame is trusted: one that is malformed, out of order or claims what cannot be leaves everything as it
// was. What stands here by index is in the order of the neighbours. Thread rule: one thread at a time.
#pragma once

#include <map>
#include <span>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "core/region/border_link.h"
#include "core/region/catalog.h"
#include "core/region/frame.h"
#include "core/region/step_result.h"

namespace tessera::region {

class Borders {
 public:
  // `catalog` must outlive it.
  Borders(RegionId self, std::span<const RegionId> neighbors, MapVersion map_version, const Catalog& catalog);

  // --- Frames in.
  // `now` is the receiver's tick. A frame that is here already is ignored. On success `taken` is the frame that was
  // added, or null; it is the newest of its sender's.
  absl::Status Put(RegionId from, std::span<const std::uint8_t> bytes, Tick now, const BorderFrame** taken);
  // Takes back the frame that the last Put added: the receiver found that its claims clash with what it owns.
  void Reject(RegionId from);
  // The newest map version that a good header called committed.
  MapVersion newest_commit() const { return newest_commit_; }
  // Neighbours whose frames the next step still needs, ascending; and whether there are none.
  std::vector<RegionId> WaitingFor() const;
  bool Ready() const;
  struct TakenFrames {
    std::vector<BorderFrame> frames;  // by neighbour; without sender where the link is down
    Tick tick;                        // the latest of `now` and those of the neighbours: who is behind adopts it
  };
  // Takes the frames that the step after `now` needs. Requires Ready().
  TakenFrames Take(Tick now);

  // --- Links.
  // The neighbour is silent: from now on nobody waits for it. Nothing for a region that is no neighbour.
  void TakeDown(RegionId neighbor);
  bool IsUp(RegionId neighbor) const;  // false for a region that is no neighbour
  bool IsUp(std::size_t neighbor) const { return borders_[neighbor].link.up(); }
  std::vector<RegionId> LinksUp() const;  // ascending
  Tick newest() const;                    // newest tick of the frames that came over links that are up
  // Whether the frame after this step will be sent to this neighbour.
  bool Speaks(RegionId neighbor) const;

  // --- Frames out.
  // The kind of message that has to be sent after the step to `now`. Ask once in a step.
  BorderLink::Duty DutyNow(std::size_t neighbor, Tick now) { return borders_[neighbor].link.DutyNow(now); }
  // Stamps a frame and promises that the next `promised` frames are like it.
  struct SentFrame {
    OutgoingFrame out;
    std::uint64_t number;  // since the link came up
  };
  SentFrame SendFrame(std::size_t neighbor, BorderFrame frame, std::uint32_t promised);
  // Stamps a request to reconnect, of which the header alone counts.
  OutgoingFrame SendReconnect(std::size_t neighbor, BorderFrame request);
  // Ghosts of the last frame that was sent to this neighbour; none after the link came up.
  std::span<const GhostRecord> sent(std::size_t neighbor) const { return borders_[neighbor].sent; }
  // The neighbour lost what it had when the link went down.
  void ForgetSent(std::size_t neighbor) { borders_[neighbor].sent.clear(); }

  // --- Maps.
  // A map may come into force: frames that go by it are kept as they came, a few of each of its neighbours, until
  // ChangeMap. MapVersion(): none may any more.
  void Expect(MapVersion version, std::span<const RegionId> neighbors);
  // Another map is in force. Links with neighbours that stay go on where they were, unless `anew`; the others begin.
  // Returns the frames that were kept, for Put.
  std::vector<std::pair<RegionId, Bytes>> ChangeMap(MapVersion version, std::span<const RegionId> neighbors, bool anew);

  void Validate() const;

 private:
  struct Border {
    BorderLink link;
    std::vector<GhostRecord> sent;  // both ends keep them: frames are written against the one before
  };
  std::ptrdiff_t IndexOf(RegionId id) const;  // -1: no neighbour
  absl::Status KeepEarly(RegionId from, MapVersion committed, std::span<const std::uint8_t> bytes);

  const RegionId self_;
  MapVersion map_version_, expected_version_, newest_commit_;
  std::vector<RegionId> expected_neighbors_;
  std::map<RegionId, std::vector<Bytes>> early_;
  const Catalog& catalog_;
  std::vector<Border> borders_;
};

}  // namespace tessera::region
