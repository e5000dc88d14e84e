// Hosts as operators see them: added, listed, drained, removed.
#include <algorithm>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "control_plane/cluster/cluster.h"
#include "control_plane/orders.h"
#include "control_plane/pages.h"

namespace tessera::control {
namespace {

absl::Status CheckHostName(const std::string& name) {
  const bool plain = std::all_of(name.begin(), name.end(), [](char c) {
    return absl::ascii_islower(static_cast<unsigned char>(c)) || absl::ascii_isdigit(static_cast<unsigned char>(c)) ||
           c == '-';
  });
  if (!name.empty() && name.size() <= kMaxNameBytes && plain && name.front() != '-' && name.back() != '-')
    return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("name: \"", OneLine(name, kMaxNameBytes), "\" is not 1 to ",
                                                 kMaxNameBytes, " lower case letters, digits and dashes between them"));
}

absl::Status NoHost(const std::string& name) {
  return absl::NotFoundError(absl::StrCat("name: no host ", OneLine(name, kMaxNameBytes)));
}

}  // namespace

absl::StatusOr<v1::AddHostResponse> Cluster::AddHost(Moment now, const v1::AddHostRequest& request) {
  if (absl::Status status = CheckHostName(request.name()); !status.ok()) return status;
  for (const auto& [number, host] : hosts_) {
    if (host.record.name() == request.name()) {
      return absl::AlreadyExistsError(
          absl::StrCat("name: ", host.record.id(), " is named ", request.name(), " already"));
    }
  }
  HostEntry host;
  host.number = counters_.last_host() + 1;
  host.record.set_id(absl::StrCat("host-", host.number));
  host.record.set_name(request.name());
  *host.record.mutable_create_time() = ToTimestamp(now.unix_time);
  v1::AddHostResponse response;
  if (request.validate_only()) {
    *response.mutable_host() = View(host);
    response.mutable_host()->clear_id();
    return response;
  }
  response.set_join_token(MakeJoinToken(random_));
  host.record.set_join_token_hash(HashSecret(response.join_token()));
  records::Counters counters = counters_;
  counters.set_last_host(host.number);
  const StoreOp ops[] = {PutOp("counters", counters.SerializeAsString(), counters_revision_),
                         PutOp(absl::StrCat("host/", host.number), host.record.SerializeAsString(), kAbsent)};
  const auto stored = store_.Txn(ops);
  if (!stored.ok()) return absl::UnavailableError(stored.status().message());
  counters_ = counters;
  counters_revision_ = host.revision = *stored;
  *response.mutable_host() = View(host);
  hosts_.emplace(host.number, std::move(host));
  return response;
}

absl::StatusOr<v1::ListHostsResponse> Cluster::ListHosts(const v1::ListHostsRequest& request) const {
  const auto page = ReadPage(request.page_size(), request.page_token());
  if (!page.ok()) return page.status();
  v1::ListHostsResponse response;
  for (auto it = hosts_.upper_bound(page->after); it != hosts_.end(); ++it) {
    if (response.hosts_size() == page->size) {
      response.set_next_page_token(PageToken(std::prev(it)->first));
      break;
    }
    *response.add_hosts() = View(it->second);
  }
  return response;
}

absl::StatusOr<v1::GetHostResponse> Cluster::GetHost(const v1::GetHostRequest& request) const {
  const HostEntry* host = FindHost(request.name());
  if (host == nullptr) return NoHost(request.name());
  v1::GetHostResponse response;
  *response.mutable_host() = View(*host);
  for (const auto& [number, index] : host->workers) {
    const InstanceEntry& instance = instances_.at(number);
    if (instance.workers[index].reported) *response.add_workers() = instance.workers[index].report;
  }
  return response;
}

absl::StatusOr<v1::DrainHostResponse> Cluster::DrainHost(Moment, const v1::DrainHostRequest& request) {
  const HostEntry* found = FindHost(request.name());
  if (found == nullptr) return NoHost(request.name());
  HostEntry& host = hosts_.at(found->number);
  records::Host next = host.record;
  next.set_draining(!request.undo());
  if (!request.validate_only() && next.draining() != host.record.draining()) {
    if (absl::Status status = StoreHost(host, next); !status.ok()) return status;
  }
  v1::DrainHostResponse response;
  *response.mutable_host() = View(host);
  return response;
}

absl::Status Cluster::RemoveHost(Moment, const v1::RemoveHostRequest& request) {
  const HostEntry* host = FindHost(request.name());
  if (host == nullptr) return NoHost(request.name());
  if (!host->workers.empty()) {
    return absl::FailedPreconditionError(absl::StrCat(
        "name: ", host->workers.size(), host->workers.size() == 1 ? " region runs" : " regions run", " on host ",
        host->record.name(), ", first ", instances_.at(host->workers.begin()->first).record.id()));
  }
  if (request.validate_only()) return absl::OkStatus();
  const auto deleted = store_.Delete(absl::StrCat("host/", host->number), host->revision);
  if (!deleted.ok()) return absl::UnavailableError(deleted.status().message());
  if (host->session != 0) {
    effects_.closed[host->session] = absl::PermissionDeniedError(absl::StrCat(host->record.id(), " was removed"));
    sessions_.erase(host->session);
  }
  hosts_.erase(host->number);
  return absl::OkStatus();
}

// Names are unique; an id is taken for one only where no host has it as its name.
const HostEntry* Cluster::FindHost(const std::string& name_or_id) const {
  for (const auto& [number, host] : hosts_) {
    if (host.record.name() == name_or_id) return &host;
  }
  const auto found = hosts_.find(NumberOf(name_or_id, "host-"));
  return found == hosts_.end() ? nullptr : &found->second;
}

v1::HostState Cluster::StateOf(const HostEntry& host) const {
  if (host.record.secret_hash().empty()) return v1::HOST_STATE_EXPECTED;
  if (host.lost) return v1::HOST_STATE_LOST;
  return host.record.draining() ? v1::HOST_STATE_DRAINING : v1::HOST_STATE_READY;
}

v1::Host Cluster::View(const HostEntry& host) const {
  v1::Host view;
  view.set_id(host.record.id());
  view.set_name(host.record.name());
  view.set_state(StateOf(host));
  view.set_advertise_address(host.record.advertise_address());
  if (host.record.has_resources()) *view.mutable_resources() = host.record.resources();
  view.set_regions(static_cast<std::uint32_t>(host.workers.size()));
  view.set_version(host.record.version());
  *view.mutable_create_time() = host.record.create_time();
  if (host.last_heartbeat_time.count() != 0)
    *view.mutable_last_heartbeat_time() = ToTimestamp(host.last_heartbeat_time);
  view.set_metrics_port(host.record.metrics_port());
  return view;
}

// Hosts that take regions. Those of `without` count as free.
std::vector<FreeHost> Cluster::FreeHosts(const InstanceEntry* without) const {
  std::vector<FreeHost> free;
  for (const auto& [number, host] : hosts_) {
    if (StateOf(host) != v1::HOST_STATE_READY) continue;
    const auto taken = std::count_if(host.workers.begin(), host.workers.end(), [without](const auto& worker) {
      return without == nullptr || worker.first != without->number;
    });
    const std::uint32_t capacity = host.record.resources().region_capacity();
    free.push_back({host.record.id(), capacity > taken ? capacity - static_cast<std::uint32_t>(taken) : 0});
  }
  return free;
}

// Those of them that are not silent: what is placed on a host that has just died waits for it in vain until it counts
// as lost.
std::vector<FreeHost> Cluster::HeardHosts(Moment now, const InstanceEntry* without) const {
  std::vector<FreeHost> heard = FreeHosts(without);
  std::erase_if(heard, [&](const FreeHost& host) {
    return now.steady - hosts_.at(NumberOf(host.id, "host-")).last_heard > settings_.failover_after;
  });
  return heard;
}

// On hosts that are not silent, if they have room: a busy machine is silent for a moment, too.
absl::StatusOr<PlacementPlan> Cluster::PlaceAnew(Moment now, const PartitionMap& map,
                                                 const InstanceEntry* without) const {
  auto placed = Place(map, HeardHosts(now, without));
  return placed.ok() ? std::move(placed) : Place(map, FreeHosts(without));
}

}  // namespace tessera::control
