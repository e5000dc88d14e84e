#include "region_worker/region_links.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/world/byte_view.h"
#include "net/protocol.h"
#include "spdlog/spdlog.h"
#include "telemetry/logging.h"

namespace tessera::worker {
RegionLinks::RegionLinks(std::unique_ptr<net::Endpoint> endpoint, WorkerMetrics& metrics, const LinkLimits& limits)
    : endpoint_(std::move(endpoint)), metrics_(metrics), limits_(limits) {}

void RegionLinks::Open(LinkIdentity identity) {
  identity_ = std::move(identity);
  identity_->self.for_regions = true;
  endpoint_->Open(identity_->self);
}

void RegionLinks::Send(RegionId to, std::span<const std::uint8_t> message) {
  const auto link = links_.find(to);
  if (link == links_.end() || !link->second.confirmed) return;
  const absl::Status sent = endpoint_->Send(link->second.peer, net::Delivery::kReliable, message);
  if (!sent.ok()) {
    spdlog::warn("not sent to={} reason={}", to.value(), telemetry::LogValue(std::string(sent.message())));
  }
}

// The endpoint says nothing of a peer that it was asked to drop.
void RegionLinks::Cut(RegionId region, std::string_view why) {
  const auto link = links_.find(region);
  if (link == links_.end() || link->second.peer == net::PeerHandle()) return;
  link->second.backoff = kMinRedial;
  link->second.dial_at = {};
  CutDial(link->second, region, why);
}

void RegionLinks::CutDial(RegionLink& link, RegionId region, std::string_view why) {
  spdlog::info("link ended region={} reason={}", region.value(), telemetry::LogValue(why));
  endpoint_->Disconnect(std::exchange(link.peer, {}));
  link.confirmed = false;
}

void RegionLinks::Service(TimePoint now, const LinkTable& table, MapVersion map_version, const LinkEvents& events) {
  const Round round{now, table, map_version, events};
  for (const net::Event& event : endpoint_->Service(std::chrono::milliseconds(0))) Handle(event, round);
  if (identity_ && !closed_) DialDue(round);
  DropSilentCallers(now);
  metrics_.link_acceptor.Take(endpoint_->acceptor_stats(), endpoint_->receive_stats());
  if (now >= show_at_) ShowLinks(now);
}

void RegionLinks::ShowLinks(TimePoint now) {
  show_at_ = now + std::chrono::seconds(1);
  for (auto& [region, link] : links_) {
    const net::PeerStats stats = link.confirmed ? endpoint_->StatsOf(link.peer) : net::PeerStats();
    const std::chrono::duration<double> round_trip = stats.round_trip;
    metrics_.ShowRoundTrip(region, round_trip.count());
    metrics_.CountParts(region, link.parts.Since({.sent = stats.parts_sent, .resent = stats.parts_resent}));
  }
}

void RegionLinks::Handle(const net::Event& event, const Round& round) {
  if (closed_) {
    if (event.kind == net::Event::Kind::kConnected) endpoint_->Disconnect(event.peer);
    return;
  }
  switch (event.kind) {
    case net::Event::Kind::kConnected:
      return OnConnected(event, round);
    case net::Event::Kind::kDisconnected:
      if (event.refusal) {
        spdlog::warn("link refused reason={} detail={}", net::WordOf(event.refusal->reason),
                     telemetry::LogValue(event.refusal->detail));
      }
      return OnDisconnected(event.peer, round);
    case net::Event::Kind::kFloods:
      return;  // links have a budget of their own (link_budget.h)
    case net::Event::Kind::kMessage:
      return OnMessage(event, round);
  }
}

void RegionLinks::OnConnected(const net::Event& event, const Round& round) {
  if (event.outgoing) {
    SendHello(event.peer, round.map_version);
  } else {
    callers_[event.peer] = {
        .until = round.now + kHelloTimeout, .region = event.who.region, .incarnation = event.who.incarnation};
  }
}

void RegionLinks::OnDisconnected(net::PeerHandle peer, const Round& round) {
  callers_.erase(peer);
  const auto found = LinkOf(peer);
  if (found == links_.end()) return;
  RegionLink& link = found->second;
  link.peer = {};
  link.dial_at = round.now + link.backoff;
  link.backoff = std::min(link.backoff * 2, kMaxRedial);
  if (!std::exchange(link.confirmed, false)) return;
  spdlog::warn("link lost region={}", found->first.value());
  round.events.down(found->first);
}

void RegionLinks::OnMessage(const net::Event& event, const Round& round) {
  if (callers_.contains(event.peer)) return OnHello(event.peer, event.bytes, round);
  const auto found = LinkOf(event.peer);
  if (found == links_.end()) return;  // dropped earlier in the same round
  if (!found->second.confirmed) return OnHello(event.peer, event.bytes, round);
  if (!found->second.budget.Take(round.now, limits_, event.bytes.size())) {
    metrics_.link_acceptor.CountFlood();
    Drop(event.peer, "it sends more than a region may");
    return OnDisconnected(event.peer, round);  // the endpoint says nothing of a peer that it was asked to drop
  }
  metrics_.frame_bytes_in.Increment(static_cast<double>(event.bytes.size()));
  if (const std::optional<LinkMessage> message = ReadLinkMessage(event.bytes)) {
    round.events.message(found->first, *message);
  } else {
    metrics_.CountDropped(DropReason::kMalformed);
  }
}

// From a caller, or the answer of one that was dialled.
void RegionLinks::OnHello(net::PeerHandle peer, std::span<const std::uint8_t> bytes, const Round& round) {
  const auto dialled = LinkOf(peer);
  const bool outgoing = dialled != links_.end();
  const Caller caller = outgoing ? Caller{.until = {}, .region = dialled->first, .incarnation = {}} : callers_.at(peer);
  callers_.erase(peer);

  v1::LinkHello hello;
  const auto proven = outgoing ? std::nullopt : std::optional(caller.incarnation);
  absl::Status status = hello.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))
                            ? CheckHello(hello, caller.region, proven, round.table)
                            : absl::InvalidArgumentError("the hello is malformed");
  if (!status.ok()) {
    (absl::IsAborted(status) ? metrics_.links_of_other_rules : metrics_.links_refused).Increment();
    Drop(peer, std::string(status.message()));
    if (outgoing) OnDisconnected(peer, round);  // the endpoint says nothing of a peer that it was asked to drop
    return;
  }
  if (!outgoing) {
    const net::PeerHandle older = links_[caller.region].peer;
    if (older != net::PeerHandle()) Drop(older, "the region has linked anew");
    SendHello(peer, round.map_version);
  }
  Confirm(caller.region, peer, Incarnation(hello.incarnation()), round);
}

void RegionLinks::Confirm(RegionId region, net::PeerHandle peer, Incarnation incarnation, const Round& round) {
  RegionLink& link = links_[region];
  link.peer = peer;
  link.confirmed = true;
  link.backoff = kMinRedial;
  spdlog::info("linked region={} at={}", region.value(), endpoint_->AddressOf(peer));
  round.events.up(region, incarnation);
}

void RegionLinks::SendHello(net::PeerHandle peer, MapVersion map_version) {
  const net::EndpointIdentity& self = identity_->self;
  v1::LinkHello hello;
  hello.set_region(self.region.value());
  hello.set_incarnation(self.incarnation.value());
  hello.set_map_version(map_version.value());
  hello.set_rules(identity_->rules);
  (void)endpoint_->Send(peer, net::Delivery::kReliable, AsBytes(hello.SerializeAsString()));
}

// `region` and `proven` are proven, by the other's certificate and its signature.
absl::Status RegionLinks::CheckHello(const v1::LinkHello& hello, RegionId region, std::optional<Incarnation> proven,
                                     const LinkTable& table) const {
  const Incarnation incarnation(hello.incarnation());
  if (RegionId(hello.region()) != region || (proven && incarnation != *proven)) {
    return absl::UnauthenticatedError(absl::StrCat("it says that it is region ", hello.region(), " incarnation ",
                                                   incarnation.value(), ", its certificate region ", region.value(),
                                                   " incarnation ", proven.value_or(incarnation).value()));
  }
  if (proven && region > identity_->self.region) {  // the lower id dials
    return absl::FailedPreconditionError(absl::StrCat("region ", region.value(), " is not expected here"));
  }
  if (absl::Status status = table.Admit(region, incarnation); !status.ok()) return status;
  if (hello.rules() != identity_->rules) {
    return absl::AbortedError(absl::StrCat("region ", region.value(),
                                           " computes by other rules (engine version or border settings): ",
                                           absl::Hex(hello.rules()), ", here ", absl::Hex(identity_->rules)));
  }
  return absl::OkStatus();
}

void RegionLinks::DialDue(const Round& round) {
  for (auto& [region, link] : links_) {
    const bool dialling = link.peer != net::PeerHandle() && !link.confirmed;
    if (!dialling) continue;
    const PeerAddress* address = round.table.AddressOf(region);
    if (!round.table.Dials(region)) {
      CutDial(link, region, "it is needed no more");
    } else if (*address != link.dialled) {
      CutDial(link, region, "the region has another worker");
    }
  }
  for (const RegionId region : round.table.partners()) {
    if (!round.table.Dials(region)) continue;
    RegionLink& link = links_[region];
    const PeerAddress& address = *round.table.AddressOf(region);
    if (address != link.dialled) {
      link.dialled = address;
      link.backoff = kMinRedial;
      link.dial_at = {};
    }
    if (link.peer == net::PeerHandle() && round.now >= link.dial_at) Dial(link, address, round.now);
  }
}

void RegionLinks::Dial(RegionLink& link, const PeerAddress& address, TimePoint now) {
  const absl::StatusOr<net::PeerHandle> peer = endpoint_->Connect(
      address.host, address.link_port, address.region, address.incarnation, net::CredentialsOf(identity_->self));
  if (peer.ok()) {
    link.peer = *peer;
    return;
  }
  if (link.backoff == kMaxRedial) {
    spdlog::warn("cannot dial region={} reason={}", address.region.value(),
                 telemetry::LogValue(std::string(peer.status().message())));
  }
  link.dial_at = now + link.backoff;
  link.backoff = std::min(link.backoff * 2, kMaxRedial);
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

std::size_t RegionLinks::linked() const {
  return static_cast<std::size_t>(
      std::ranges::count_if(links_, [](const auto& entry) { return entry.second.confirmed; }));
}

std::optional<TimePoint> RegionLinks::NextDial(const LinkTable& table) const {
  std::optional<TimePoint> next;
  if (!identity_) return next;
  for (const RegionId region : table.partners()) {
    if (!table.Dials(region)) continue;
    const auto link = links_.find(region);
    if (link != links_.end() && link->second.peer != net::PeerHandle()) continue;
    const TimePoint dial_at = link == links_.end() ? TimePoint() : link->second.dial_at;
    if (!next || dial_at < *next) next = dial_at;
  }
  return next;
}

RegionLinks::Links::iterator RegionLinks::LinkOf(net::PeerHandle peer) {
  return std::ranges::find_if(links_, [&](const auto& link) { return link.second.peer == peer; });
}

}  // namespace tessera::worker
