// RegionLinks: the connections to other regions. Sockets and hellos only: with whom to link, whom to let in and what to
// send is decided by the core (core/link_table.h).
//
// The side with the lower id dials, again and again, and shows the other's acceptor its certificate, as that shows it
// its own. The first message each way is a LinkHello; the side that was dialled answers only one that it agrees with.
//
//   RegionLinks links(*std::move(endpoint), metrics);
//   links.Open(identity);
//   loop: links.Service(now, core.links(), map_version, events);
//   links.Send(to, message);
//
// Thread rule: one thread.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include "core/region/rules.h"
#include "net/endpoint.h"
#include "region_worker/core/identity.h"
#include "region_worker/core/link_message.h"
#include "region_worker/core/link_table.h"
#include "region_worker/core/time.h"
#include "region_worker/link_budget.h"
#include "region_worker/link_parts.h"
#include "region_worker/worker_metrics.h"
#include "tessera/v1/game.pb.h"

namespace tessera::worker {

struct LinkIdentity {
  net::EndpointIdentity self;
  std::uint64_t rules = region::RulesOf(region::RegionSettings());  // partners must have the same
};

// Called from within Service. A link that the core has cut is not reported.
struct LinkEvents {
  std::function<void(RegionId region, Incarnation incarnation)> up;
  std::function<void(RegionId region)> down;
  std::function<void(RegionId from, const LinkMessage& message)> message;
};

class RegionLinks {
 public:
  static constexpr Duration kMinRedial = std::chrono::milliseconds(20), kMaxRedial = std::chrono::milliseconds(1000);
  static constexpr Duration kHelloTimeout = std::chrono::seconds(3);  // for a neighbour that says nothing

  RegionLinks(std::unique_ptr<net::Endpoint> endpoint, WorkerMetrics& metrics, const LinkLimits& limits = {});

  std::uint16_t port() const { return endpoint_->port(); }
  int socket() const { return endpoint_->socket(); }

  // From now on hellos are answered and partners dialled. Once.
  void Open(LinkIdentity identity);
  // Takes in what has come, without waiting, and dials as `table` says. `map_version` goes into hellos.
  void Service(TimePoint now, const LinkTable& table, MapVersion map_version, const LinkEvents& events);
  // Reliably; lost when there is no link.
  void Send(RegionId to, std::span<const std::uint8_t> message);
  void Flush() { endpoint_->Flush(); }
  void Cut(RegionId region, std::string_view why);
  void Close();                                                   // ends all links in order
  bool draining() const { return endpoint_->connections() > 0; }  // while Close is under way

  std::size_t linked() const;
  std::optional<TimePoint> NextDial(const LinkTable& table) const;

 private:
  struct RegionLink {
    net::PeerHandle peer;  // dialled or confirmed; none: PeerHandle()
    bool confirmed = false;
    PeerAddress dialled;  // at which address
    TimePoint dial_at{};
    Duration backoff = kMinRedial;
    LinkBudget budget{};  // stays when the link ends
    LinkParts parts{};
  };
  // Accepted, but has not sent its hello.
  struct Caller {
    TimePoint until{};
    RegionId region;  // proven
    Incarnation incarnation;
  };
  // Context of one call of Service.
  struct Round {
    TimePoint now;
    const LinkTable& table;
    MapVersion map_version;
    const LinkEvents& events;
  };
  using Links = std::map<RegionId, RegionLink>;

  void Handle(const net::Event& event, const Round& round);
  void OnConnected(const net::Event& event, const Round& round);
  void OnDisconnected(net::PeerHandle peer, const Round& round);
  void OnMessage(const net::Event& event, const Round& round);
  void OnHello(net::PeerHandle peer, std::span<const std::uint8_t> bytes, const Round& round);
  void Confirm(RegionId region, net::PeerHandle peer, Incarnation incarnation, const Round& round);
  void DialDue(const Round& round);
  void Dial(RegionLink& link, const PeerAddress& address, TimePoint now);
  void CutDial(RegionLink& link, RegionId region, std::string_view why);
  void DropSilentCallers(TimePoint now);
  void ShowLinks(TimePoint now);
  void SendHello(net::PeerHandle peer, MapVersion map_version);
  absl::Status CheckHello(const v1::LinkHello& hello, RegionId region, std::optional<Incarnation> proven,
                          const LinkTable& table) const;
  void Drop(net::PeerHandle peer, std::string_view why);
  Links::iterator LinkOf(net::PeerHandle peer);

  std::unique_ptr<net::Endpoint> endpoint_;
  WorkerMetrics& metrics_;
  const LinkLimits limits_;
  std::optional<LinkIdentity> identity_;
  bool closed_ = false;
  Links links_;
  TimePoint show_at_{};  // when the metrics of links are shown again
  std::map<net::PeerHandle, Caller> callers_;
};

}  // namespace tessera::worker
