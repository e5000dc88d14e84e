// RegionLinks: the connections to other regions, and what goes over them: frames to neighbours, the log to the heir,
// its acknowledgements to the wards (link_message.h).
//
// Which regions those are changes while the world runs: SetPartners says whom this region needs, SetPeers where they
// are. Of two partners the one with the lower id dials, again and again, and shows the other's door a token that it has
// made itself, for both hold the instance's key. The first message each way is a LinkHello; the side that was dialled
// answers only one that it agrees with. It may learn later than the dialler that the two need each other, so it lets in
// every region that has an address; the dialler ends a link that nobody needs any more.
//
// A link that breaks loses what was on its way, so the last two frames for each neighbour are kept and sent when a
// link is confirmed: neighbours in step are at most one tick apart. Frames of tick 0 take the same way.
//
//   RegionLinks links(*std::move(endpoint), metrics);
//   links.Open(identity, map_version);
//   links.SetPeers(order.peers);
//   links.SetPartners(regions);
//   loop: links.Service(now, [&](RegionId from, LinkMessage message) { ... });  links.Send(std::move(result.frames));
//
// Thread rule: one thread.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "core/region/region.h"
#include "core/region/rules.h"
#include "net/connect_token.h"
#include "net/endpoint.h"
#include "region_worker/link_message.h"
#include "region_worker/link_port.h"
#include "region_worker/order.h"
#include "region_worker/tick_pacer.h"
#include "region_worker/worker_metrics.h"
#include "tessera/v1/game.pb.h"

namespace tessera::worker {

struct LinkIdentity {
  Identity self;
  MapVersion map_version;
  net::InstanceKey key;
  std::uint64_t rules = region::RulesOf(region::Settings());  // of which partners must have the same
};

class RegionLinks final : public LinkPort {
 public:
  using OnLinkMessage = std::function<void(RegionId from, const LinkMessage& message)>;

  static constexpr Duration kMinRedial = std::chrono::milliseconds(20), kMaxRedial = std::chrono::milliseconds(1000);
  static constexpr Duration kHelloTimeout = std::chrono::seconds(3);  // of a neighbour that says nothing
  // Of a token that this region makes for itself: for one dial, with room for clocks that differ.
  static constexpr std::chrono::seconds kTokenLifetime{600};
  static constexpr std::size_t kFramesKept = 2;

  RegionLinks(std::unique_ptr<net::Endpoint> endpoint, WorkerMetrics& metrics);

  std::uint16_t port() const { return endpoint_->port(); }
  int socket() const { return endpoint_->socket(); }

  // From now on hellos are answered and partners dialled. Once.
  void Open(LinkIdentity identity);
  void SetMapVersion(MapVersion version) override { identity_->map_version = version; }
  // Where regions are. A region of a higher incarnation than the one that is linked is another worker: it is dialled.
  void SetPeers(std::span<const PeerAddress> peers);
  // With whom this region needs a link. Others that this side dialled are ended.
  void SetPartners(std::span<const RegionId> partners);
  void Outrank(RegionId region, Incarnation incarnation) override;

  // Frames: sends to those that are linked, and keeps for those that are not.
  void Send(std::vector<region::OutgoingFrame> frames);
  // The last frame once more to each that is linked: the first may have come before its map was known there.
  void SendAgain();
  bool SendNow(RegionId to, std::span<const std::uint8_t> message) override;
  net::PeerHandle LinkTo(RegionId region) const override;
  // When something last came from that region; the time of linking at first.
  std::optional<TimePoint> HeardFrom(RegionId region) const;
  // An error once a frame was too large to be sent: its neighbour will wait for it in vain.
  const absl::Status& health() const { return health_; }
  // Takes in what has come, without waiting. True if anything had.
  bool Service(TimePoint now, const OnLinkMessage& on_message);
  void Close();                                                   // ends all links in order
  bool draining() const { return endpoint_->connections() > 0; }  // while Close is under way

  std::vector<RegionId> linked() const;  // ascending
  bool AllLinked() const;                // with all partners; false before Open
  std::optional<TimePoint> next_dial() const;

 private:
  struct Link {
    net::PeerHandle peer;  // dialled or confirmed; none: PeerHandle()
    bool confirmed = false;
    Incarnation incarnation;  // that the peer has proven, once confirmed
    TimePoint dial_at{}, heard{};
    Duration backoff = kMinRedial;
    std::vector<net::Bytes> kept;  // oldest first
  };
  // Let in by the door, has not said its hello.
  struct Caller {
    TimePoint until{};
    RegionId region;  // proven
    Incarnation incarnation;
  };

  void Handle(const net::Event& event, TimePoint now, const OnLinkMessage& on_message);
  void OnConnected(const net::Event& event, TimePoint now);
  void OnDisconnected(net::PeerHandle peer, TimePoint now);
  void OnMessage(const net::Event& event, TimePoint now, const OnLinkMessage& on_message);
  void OnHello(net::PeerHandle peer, std::span<const std::uint8_t> bytes, TimePoint now);
  void DialDue(TimePoint now);
  void DropSilentCallers(TimePoint now);
  void Confirm(RegionId region, Link& link, net::PeerHandle peer, Incarnation incarnation, TimePoint now);
  void Cut(RegionId region, Link& link, std::string_view why);
  void SendHello(net::PeerHandle peer);
  absl::Status CheckHello(const v1::LinkHello& hello, RegionId region, std::optional<Incarnation> incarnation) const;
  void Drop(net::PeerHandle peer, std::string_view why);
  std::map<RegionId, Link>::iterator LinkOf(net::PeerHandle peer);
  bool Dials(RegionId region, const Link& link) const;  // this side is to dial, and may

  std::unique_ptr<net::Endpoint> endpoint_;
  WorkerMetrics& metrics_;
  std::optional<LinkIdentity> identity_;
  bool closed_ = false;
  absl::Status health_;
  std::set<RegionId> partners_;
  std::map<RegionId, PeerAddress> addresses_;
  std::map<RegionId, Incarnation> outranked_;  // the highest life that has ended
  std::map<RegionId, Link> links_;
  std::map<net::PeerHandle, Caller> callers_;
};

}  // namespace tessera::worker
