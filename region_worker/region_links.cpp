#include "region_worker/region_links.h"

#include <algorithm>
#include <ctime>

#include "absl/strings/str_cat.h"
#include "net/protocol.h"
#include "spdlog/spdlog.h"
#include "telemetry/logging.h"

namespace tessera::worker {
namespace {

std::span<const std::uint8_t> AsBytes(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

}  // namespace

RegionLinks::RegionLinks(std::unique_ptr<net::Endpoint> endpoint, WorkerMetrics& metrics)
    : endpoint_(std::move(endpoint)), metrics_(metrics) {}

void RegionLinks::Open(LinkIdentity identity, std::span<const RegionId> neighbors) {
  identity_ = std::move(identity);
  endpoint_->Open({.instance_id = identity_->self.instance_id,
                   .region = identity_->self.region,
                   .incarnation = identity_->self.incarnation,
                   .key = identity_->key,
                   .for_regions = true});
  for (const RegionId neighbor : neighbors) links_.try_emplace(neighbor);
}

void RegionLinks::SetPeers(std::span<const PeerAddress> peers) {
  for (const PeerAddress& peer : peers) {
    const auto found = links_.find(peer.region);
    if (found == links_.end() || found->second.address == peer) continue;
    Link& link = found->second;
    link.address = peer;
    link.backoff = kMinRedial;
    link.dial_at = {};
  }
}

void RegionLinks::Send(std::vector<region::OutgoingFrame> frames) {
  for (region::OutgoingFrame& frame : frames) {
    Link& link = links_[frame.to];
    if (frame.bytes.size() > net::kMaxFrameBytes) {
      health_ = absl::ResourceExhaustedError(absl::StrCat("frame of ", frame.bytes.size(), " bytes for region ",
                                                          frame.to.value(), ": at most ", net::kMaxFrameBytes));
    }
    metrics_.frame_bytes_out.Increment(static_cast<double>(frame.bytes.size()));
    if (link.confirmed) {
      if (const absl::Status sent = endpoint_->Send(link.peer, net::Delivery::kReliable, frame.bytes); !sent.ok()) {
        spdlog::warn("frame not sent to={} reason={}", frame.to.value(),
                     telemetry::LogValue(std::string(sent.message())));
      }
    }
    if (link.kept.size() == kFramesKept) link.kept.erase(link.kept.begin());
    link.kept.push_back(std::move(frame.bytes));
  }
  endpoint_->Flush();
}

bool RegionLinks::Service(TimePoint now, const OnFrame& on_frame) {
  const std::vector<net::Event> events = endpoint_->Service(std::chrono::milliseconds(0));
  for (const net::Event& event : events) Handle(event, now, on_frame);
  if (identity_ && !closed_) DialDue(now);
  DropSilentCallers(now);
  metrics_.link_door.Take(endpoint_->door_stats());
  return !events.empty();
}

void RegionLinks::Handle(const net::Event& event, TimePoint now, const OnFrame& on_frame) {
  if (closed_) {
    if (event.kind == net::Event::Kind::kConnected) endpoint_->Disconnect(event.peer);
    return;
  }
  switch (event.kind) {
    case net::Event::Kind::kConnected:
      return OnConnected(event, now);
    case net::Event::Kind::kDisconnected:
      if (event.refusal) {
        spdlog::warn("link refused reason={} detail={}", net::WordOf(event.refusal->reason),
                     telemetry::LogValue(event.refusal->detail));
      }
      return OnDisconnected(event.peer, now);
    case net::Event::Kind::kMessage:
      return OnMessage(event, now, on_frame);
  }
}

void RegionLinks::OnConnected(const net::Event& event, TimePoint now) {
  if (event.outgoing) {
    SendHello(event.peer);
  } else {
    callers_[event.peer] = {
        .until = now + kHelloTimeout, .region = event.who.region, .incarnation = event.who.incarnation};
  }
}

void RegionLinks::OnDisconnected(net::PeerHandle peer, TimePoint now) {
  callers_.erase(peer);
  const auto found = LinkOf(peer);
  if (found == links_.end()) return;
  Link& link = found->second;
  if (link.confirmed) spdlog::warn("link lost region={}", found->first.value());
  link.peer = {};
  link.confirmed = false;
  link.dial_at = now + link.backoff;
  link.backoff = std::min(link.backoff * 2, kMaxRedial);
}

void RegionLinks::OnMessage(const net::Event& event, TimePoint now, const OnFrame& on_frame) {
  if (callers_.contains(event.peer)) return OnHello(event.peer, event.bytes, now);
  const auto found = LinkOf(event.peer);
  if (found == links_.end()) return;  // dropped earlier in the same round
  if (!found->second.confirmed) {
    OnHello(event.peer, event.bytes, now);
    return;
  }
  metrics_.frame_bytes_in.Increment(static_cast<double>(event.bytes.size()));
  on_frame(found->first, event.bytes);
}

// From a caller, or the answer of one that was dialled.
void RegionLinks::OnHello(net::PeerHandle peer, std::span<const std::uint8_t> bytes, TimePoint now) {
  const auto dialled = LinkOf(peer);
  const bool outgoing = dialled != links_.end();
  const Caller caller = outgoing ? Caller{.until = {}, .region = dialled->first, .incarnation = {}} : callers_.at(peer);
  callers_.erase(peer);

  v1::LinkHello hello;
  const auto incarnation = outgoing ? std::nullopt : std::optional(caller.incarnation);
  absl::Status status = hello.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))
                            ? CheckHello(hello, caller.region, incarnation)
                            : absl::InvalidArgumentError("the hello is malformed");
  if (!status.ok()) {
    Drop(peer, std::string(status.message()));
    if (outgoing) OnDisconnected(peer, now);  // an endpoint tells nothing of a peer that it was told to drop
    return;
  }
  Link& link = links_.at(caller.region);
  if (!outgoing) {
    if (link.peer != net::PeerHandle()) Drop(link.peer, "the neighbour has linked anew");
    SendHello(peer);
  }
  Confirm(caller.region, link, peer);
}

void RegionLinks::Confirm(RegionId region, Link& link, net::PeerHandle peer) {
  link.peer = peer;
  link.confirmed = true;
  link.backoff = kMinRedial;
  spdlog::info("linked region={} at={}", region.value(), endpoint_->AddressOf(peer));
  for (const net::Bytes& frame : link.kept) (void)endpoint_->Send(peer, net::Delivery::kReliable, frame);
  endpoint_->Flush();
}

void RegionLinks::SendHello(net::PeerHandle peer) {
  const Identity& self = identity_->self;
  v1::LinkHello hello;
  hello.set_region(self.region.value());
  hello.set_incarnation(self.incarnation.value());
  hello.set_map_version(identity_->map_version.value());
  (void)endpoint_->Send(peer, net::Delivery::kReliable, AsBytes(hello.SerializeAsString()));
}

// `region` and `incarnation` are proven: by the keys that the door it let us in at derived, or by the caller's token.
absl::Status RegionLinks::CheckHello(const v1::LinkHello& hello, RegionId region,
                                     std::optional<Incarnation> proven) const {
  const Incarnation incarnation(hello.incarnation());
  const MapVersion version(hello.map_version());
  if (RegionId(hello.region()) != region || (proven && incarnation != *proven)) {
    return absl::UnauthenticatedError(absl::StrCat("it says that it is region ", hello.region(), " incarnation ",
                                                   incarnation.value(), ", its token region ", region.value(),
                                                   " incarnation ", proven.value_or(incarnation).value()));
  }
  const auto link = links_.find(region);
  if (link == links_.end() || (proven && region > identity_->self.region)) {  // the lower id dials
    return absl::FailedPreconditionError(absl::StrCat("region ", region.value(), " is not expected here"));
  }
  if (version != identity_->map_version) {
    return absl::FailedPreconditionError(
        absl::StrCat("map version ", version.value(), ", this is ", identity_->map_version.value()));
  }
  if (link->second.address && incarnation < link->second.address->incarnation) {
    return absl::FailedPreconditionError(absl::StrCat("incarnation ", incarnation.value(), " is outranked by ",
                                                      link->second.address->incarnation.value()));
  }
  return absl::OkStatus();
}

void RegionLinks::DialDue(TimePoint now) {
  for (auto& [region, link] : links_) {
    const bool mine = identity_->self.region < region;
    if (!mine || !link.address || link.peer != net::PeerHandle() || now < link.dial_at) continue;
    const net::ConnectToken token = {
        .instance_id = identity_->self.instance_id,
        .expires_unix_s = static_cast<std::uint64_t>(std::time(nullptr) + kTokenLifetime.count()),
        .region = identity_->self.region,
        .incarnation = identity_->self.incarnation};
    const absl::StatusOr<net::PeerHandle> peer =
        endpoint_->Connect(link.address->host, link.address->link_port, region, net::Issue(token, identity_->key));
    if (peer.ok()) {
      link.peer = *peer;
      continue;
    }
    if (link.backoff == kMaxRedial) {
      spdlog::warn("cannot dial region={} reason={}", region.value(),
                   telemetry::LogValue(std::string(peer.status().message())));
    }
    link.dial_at = now + link.backoff;
    link.backoff = std::min(link.backoff * 2, kMaxRedial);
  }
}

void RegionLinks::DropSilentCallers(TimePoint now) {
  for (auto it = callers_.begin(); it != callers_.end();) {
    const auto [peer, caller] = *it++;
    if (now < caller.until) continue;
    callers_.erase(peer);
    Drop(peer, "it said no hello");
  }
}

void RegionLinks::Drop(net::PeerHandle peer, std::string_view why) {
  spdlog::warn("link dropped from={} reason={}", endpoint_->AddressOf(peer), telemetry::LogValue(why));
  endpoint_->Disconnect(peer);
}

void RegionLinks::Close() {
  closed_ = true;
  endpoint_->Close("this region ends");
  for (auto& [region, link] : links_) {
    if (link.peer != net::PeerHandle()) endpoint_->Disconnect(std::exchange(link.peer, {}));
    link.confirmed = false;
  }
  for (const auto& [peer, caller] : callers_) endpoint_->Disconnect(peer);
  callers_.clear();
  endpoint_->Flush();
}

std::vector<RegionId> RegionLinks::linked() const {
  std::vector<RegionId> regions;
  for (const auto& [region, link] : links_) {
    if (link.confirmed) regions.push_back(region);
  }
  return regions;
}

bool RegionLinks::AllLinked() const {
  return identity_ && std::all_of(links_.begin(), links_.end(), [](const auto& link) { return link.second.confirmed; });
}

std::optional<TimePoint> RegionLinks::next_dial() const {
  std::optional<TimePoint> next;
  if (!identity_) return next;
  for (const auto& [region, link] : links_) {
    const bool waits = identity_->self.region < region && link.address && link.peer == net::PeerHandle();
    if (waits && (!next || link.dial_at < *next)) next = link.dial_at;
  }
  return next;
}

std::map<RegionId, RegionLinks::Link>::iterator RegionLinks::LinkOf(net::PeerHandle peer) {
  return std::find_if(links_.begin(), links_.end(), [&](const auto& link) { return link.second.peer == peer; });
}

}  // namespace tessera::worker
