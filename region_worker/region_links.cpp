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

void RegionLinks::Open(LinkIdentity identity) {
  identity_ = std::move(identity);
  endpoint_->Open({.instance_id = identity_->self.instance_id,
                   .region = identity_->self.region,
                   .incarnation = identity_->self.incarnation,
                   .key = identity_->key,
                   .for_regions = true});
}

void RegionLinks::SetPeers(std::span<const PeerAddress> peers) {
  for (const PeerAddress& peer : peers) {
    const auto [found, is_new] = addresses_.try_emplace(peer.region, peer);
    if (!is_new && (found->second == peer || peer.incarnation < found->second.incarnation)) continue;
    found->second = peer;
    const auto link = links_.find(peer.region);
    if (link == links_.end()) continue;
    link->second.backoff = kMinRedial;
    link->second.dial_at = {};
    const bool another =
        link->second.confirmed ? link->second.incarnation < peer.incarnation : link->second.peer != net::PeerHandle();
    if (another) Cut(peer.region, link->second, "the region has another worker");
  }
}

void RegionLinks::SetPartners(std::span<const RegionId> partners) {
  partners_ = {partners.begin(), partners.end()};
  for (const RegionId partner : partners_) links_.try_emplace(partner);
  for (auto it = links_.begin(); it != links_.end();) {
    const auto next = std::next(it);
    const bool mine = identity_ && identity_->self.region < it->first;
    if (!partners_.contains(it->first)) {
      it->second.kept.clear();
      if (mine) {
        Cut(it->first, it->second, "it is needed no more");
        links_.erase(it);
      }
    }
    it = next;
  }
}

void RegionLinks::Outrank(RegionId region, Incarnation incarnation) {
  Incarnation& highest = outranked_[region];
  highest = std::max(highest, incarnation);
  const auto link = links_.find(region);
  if (link == links_.end()) return;
  const auto address = addresses_.find(region);
  const bool later_one = link->second.confirmed
                             ? incarnation < link->second.incarnation
                             : address != addresses_.end() && incarnation < address->second.incarnation;
  if (later_one) return;
  Cut(region, link->second, "the region has died");
  link->second.kept.clear();
}

// The endpoint tells nothing of a peer that it was told to drop.
void RegionLinks::Cut(RegionId region, Link& link, std::string_view why) {
  if (link.peer == net::PeerHandle()) return;
  spdlog::info("link ended region={} reason={}", region.value(), telemetry::LogValue(why));
  endpoint_->Disconnect(std::exchange(link.peer, {}));
  link.confirmed = false;
}

void RegionLinks::Send(std::vector<region::OutgoingFrame> frames) {
  for (region::OutgoingFrame& frame : frames) {
    Link& link = links_[frame.to];
    if (frame.bytes.size() > net::kMaxFrameBytes) {
      health_ = absl::ResourceExhaustedError(absl::StrCat("frame of ", frame.bytes.size(), " bytes for region ",
                                                          frame.to.value(), ": at most ", net::kMaxFrameBytes));
    }
    metrics_.frame_bytes_out.Increment(static_cast<double>(frame.bytes.size()));
    if (link.confirmed) (void)SendNow(frame.to, frame.bytes);
    if (link.kept.size() == kFramesKept) link.kept.erase(link.kept.begin());
    link.kept.push_back(std::move(frame.bytes));
  }
  endpoint_->Flush();
}

void RegionLinks::SendAgain() {
  for (const auto& [region, link] : links_) {
    if (link.confirmed && !link.kept.empty()) (void)SendNow(region, link.kept.back());
  }
  endpoint_->Flush();
}

bool RegionLinks::SendNow(RegionId to, std::span<const std::uint8_t> message) {
  const auto link = links_.find(to);
  if (link == links_.end() || !link->second.confirmed) return false;
  const absl::Status sent = endpoint_->Send(link->second.peer, net::Delivery::kReliable, message);
  if (!sent.ok()) {
    spdlog::warn("not sent to={} reason={}", to.value(), telemetry::LogValue(std::string(sent.message())));
  }
  return sent.ok();
}

net::PeerHandle RegionLinks::LinkTo(RegionId region) const {
  const auto link = links_.find(region);
  return link == links_.end() || !link->second.confirmed ? net::PeerHandle() : link->second.peer;
}

std::optional<TimePoint> RegionLinks::HeardFrom(RegionId region) const {
  const auto link = links_.find(region);
  if (link == links_.end() || link->second.heard == TimePoint()) return std::nullopt;
  return link->second.heard;
}

bool RegionLinks::Service(TimePoint now, const OnLinkMessage& on_message) {
  const std::vector<net::Event> events = endpoint_->Service(std::chrono::milliseconds(0));
  for (const net::Event& event : events) Handle(event, now, on_message);
  if (identity_ && !closed_) DialDue(now);
  DropSilentCallers(now);
  metrics_.link_door.Take(endpoint_->door_stats());
  return !events.empty();
}

void RegionLinks::Handle(const net::Event& event, TimePoint now, const OnLinkMessage& on_message) {
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
      return OnMessage(event, now, on_message);
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

void RegionLinks::OnMessage(const net::Event& event, TimePoint now, const OnLinkMessage& on_message) {
  if (callers_.contains(event.peer)) return OnHello(event.peer, event.bytes, now);
  const auto found = LinkOf(event.peer);
  if (found == links_.end()) return;  // dropped earlier in the same round
  if (!found->second.confirmed) {
    OnHello(event.peer, event.bytes, now);
    return;
  }
  metrics_.frame_bytes_in.Increment(static_cast<double>(event.bytes.size()));
  found->second.heard = now;
  if (const std::optional<LinkMessage> message = ReadLinkMessage(event.bytes)) {
    on_message(found->first, *message);
  } else {
    metrics_.CountDropped(DropReason::kMalformed);
  }
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
    (absl::IsAborted(status) ? metrics_.links_of_other_rules : metrics_.links_refused).Increment();
    Drop(peer, std::string(status.message()));
    if (outgoing) OnDisconnected(peer, now);  // an endpoint tells nothing of a peer that it was told to drop
    return;
  }
  Link& link = links_[caller.region];
  if (!outgoing) {
    if (link.peer != net::PeerHandle()) Drop(link.peer, "the region has linked anew");
    SendHello(peer);
  }
  Confirm(caller.region, link, peer, Incarnation(hello.incarnation()), now);
}

void RegionLinks::Confirm(RegionId region, Link& link, net::PeerHandle peer, Incarnation incarnation, TimePoint now) {
  link.peer = peer;
  link.confirmed = true;
  link.incarnation = incarnation;
  link.heard = now;
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
  hello.set_rules(identity_->rules);
  (void)endpoint_->Send(peer, net::Delivery::kReliable, AsBytes(hello.SerializeAsString()));
}

// `region` and `incarnation` are proven: by the keys that the door it let us in at derived, or by the caller's token.
absl::Status RegionLinks::CheckHello(const v1::LinkHello& hello, RegionId region,
                                     std::optional<Incarnation> proven) const {
  const Incarnation incarnation(hello.incarnation());
  if (RegionId(hello.region()) != region || (proven && incarnation != *proven)) {
    return absl::UnauthenticatedError(absl::StrCat("it says that it is region ", hello.region(), " incarnation ",
                                                   incarnation.value(), ", its token region ", region.value(),
                                                   " incarnation ", proven.value_or(incarnation).value()));
  }
  const auto address = addresses_.find(region);
  const bool known = partners_.contains(region) || address != addresses_.end();
  if (!known || (proven && region > identity_->self.region)) {  // the lower id dials
    return absl::FailedPreconditionError(absl::StrCat("region ", region.value(), " is not expected here"));
  }
  const auto ended = outranked_.find(region);
  if (ended != outranked_.end() && incarnation <= ended->second) {
    return absl::FailedPreconditionError(absl::StrCat("incarnation ", incarnation.value(), " has been declared dead"));
  }
  if (address != addresses_.end() && incarnation < address->second.incarnation) {
    return absl::FailedPreconditionError(
        absl::StrCat("incarnation ", incarnation.value(), " is outranked by ", address->second.incarnation.value()));
  }
  if (hello.rules() != identity_->rules) {
    return absl::AbortedError(absl::StrCat("region ", region.value(),
                                           " computes by other rules (engine version or border settings): ",
                                           absl::Hex(hello.rules()), ", here ", absl::Hex(identity_->rules)));
  }
  return absl::OkStatus();
}

bool RegionLinks::Dials(RegionId region, const Link& link) const {
  if (!identity_ || region <= identity_->self.region || link.peer != net::PeerHandle()) return false;
  const auto address = addresses_.find(region);
  if (address == addresses_.end() || !partners_.contains(region)) return false;
  const auto ended = outranked_.find(region);
  return ended == outranked_.end() || ended->second < address->second.incarnation;
}

void RegionLinks::DialDue(TimePoint now) {
  for (auto& [region, link] : links_) {
    if (now < link.dial_at || !Dials(region, link)) continue;
    const PeerAddress& address = addresses_.at(region);
    const net::ConnectToken token = {
        .instance_id = identity_->self.instance_id,
        .expires_unix_s = static_cast<std::uint64_t>(std::time(nullptr) + kTokenLifetime.count()),
        .region = identity_->self.region,
        .incarnation = identity_->self.incarnation};
    const absl::StatusOr<net::PeerHandle> peer =
        endpoint_->Connect(address.host, address.link_port, region, net::Issue(token, identity_->key));
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
  return identity_ && std::all_of(partners_.begin(), partners_.end(),
                                  [&](RegionId partner) { return LinkTo(partner) != net::PeerHandle(); });
}

std::optional<TimePoint> RegionLinks::next_dial() const {
  std::optional<TimePoint> next;
  if (!identity_) return next;
  for (const auto& [region, link] : links_) {
    if (Dials(region, link) && (!next || link.dial_at < *next)) next = link.dial_at;
  }
  return next;
}

std::map<RegionId, RegionLinks::Link>::iterator RegionLinks::LinkOf(net::PeerHandle peer) {
  return std::find_if(links_.begin(), links_.end(), [&](const auto& link) { return link.second.peer == peer; });
}

}  // namespace tessera::worker
