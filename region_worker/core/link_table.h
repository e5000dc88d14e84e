// LinkTable: with which regions this one wants links, which lives of them it lets in, and what stands.
//
// Orders say where regions are and which lives have ended; the map and the order say who is a partner. Of two partners
// the one with the lower id dials. It may learn later than the other that the two need each other, so every region that
// has an address is let in; the dialler ends a link that nobody needs any more.
//
// A link that breaks loses what was on its way, so the last two frames for each neighbour are kept and sent again on a
// new link: neighbours in step are at most one tick apart. Frames of a life that has ended, or of a region that was
// built anew, are kept for nobody.
//
//   LinkTable links(self);
//   links.SetAddresses(order.peers, actions);
//   links.SetPartners(regions, actions);
//   shell: if (links.Dials(region)) dial links.AddressOf(region);   if (links.Admit(region, incarnation).ok()) LinkUp
//   links.SendFrames(std::move(result.frames), actions);
//
// Thread rule: one thread.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "core/region/region.h"
#include "core/world/ids.h"
#include "region_worker/core/actions.h"
#include "region_worker/core/peer_address.h"
#include "region_worker/core/time.h"

namespace tessera::worker {

class LinkTable {
 public:
  static constexpr std::size_t kFramesKept = 2;
  // Each new link has another; 0: there is none.
  using LinkNumber = std::uint64_t;

  explicit LinkTable(RegionId self) : self_(self) {}

  // --- Whom to link with.
  // Where regions are. A region of a higher incarnation than the one that is linked is another worker: its link is cut.
  void SetAddresses(std::span<const PeerAddress> peers, Actions& actions);
  // With whom this region needs links. Others that this side dialled are cut.
  void SetPartners(std::span<const RegionId> partners, Actions& actions);
  // This life of the region has ended, or is taken to have ended: its link is cut, and it is let in no more.
  void Fence(RegionId region, Incarnation incarnation, Actions& actions);
  const std::set<RegionId>& partners() const { return partners_; }
  // Null where it is not known.
  const PeerAddress* AddressOf(RegionId region) const;
  // A link is wanted, and this side is to dial it.
  bool Dials(RegionId region) const;
  // Whether this life of a region is let in. FAILED_PRECONDITION says why not.
  absl::Status Admit(RegionId region, Incarnation incarnation) const;

  // --- Links that stand.
  // Takes the place of an older link to that region.
  void Up(RegionId region, Incarnation incarnation, TimePoint now, Actions& actions);
  void Down(RegionId region);
  void Heard(RegionId region, TimePoint now);
  LinkNumber LinkTo(RegionId region) const;
  // When something last came from that region, its link at first. Stays when the link ends.
  std::optional<TimePoint> HeardFrom(RegionId region) const;
  std::vector<RegionId> Linked() const;  // ascending
  bool AllLinked() const;                // all partners are

  // --- Messages.
  using Message = std::shared_ptr<const region::Bytes>;
  void Send(RegionId to, region::Bytes message, Actions& actions) const;
  void Send(RegionId to, const Message& message, Actions& actions) const;
  // Frames: sent to those that are linked, kept for those that are not.
  void SendFrames(std::vector<region::OutgoingFrame> frames, Actions& actions);
  // The last frame once more to each that is linked: the first may have come before its map was known there.
  void RepeatFrames(Actions& actions) const;
  // The region is built anew: what it sent before is not of its life.
  void ForgetFrames();
  std::uint64_t frame_bytes() const { return frame_bytes_; }  // in all frames
  // RESOURCE_EXHAUSTED once a frame was too large to be sent: its neighbour will wait for it in vain.
  const absl::Status& health() const { return health_; }

 private:
  struct Partner {
    LinkNumber link = 0;
    Incarnation incarnation;  // at the link's other end
    TimePoint heard{};
    std::vector<Message> kept;  // oldest first
  };
  bool Ended(RegionId region, Incarnation incarnation) const;
  void Cut(RegionId region, Partner& partner, std::string why, Actions& actions);

  RegionId self_;
  std::set<RegionId> partners_;
  std::map<RegionId, PeerAddress> addresses_;
  std::map<RegionId, Incarnation> fenced_;  // the highest life that has ended
  std::map<RegionId, Partner> regions_;
  LinkNumber links_ = 0;
  std::uint64_t frame_bytes_ = 0;
  absl::Status health_;
};

}  // namespace tessera::worker
