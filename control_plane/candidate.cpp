#include "control_plane/candidate.h"

#include <spdlog/spdlog.h>

#include <thread>

#include "absl/strings/str_cat.h"
#include "control_plane/etcd/etcd_store.h"

namespace tessera::control {
namespace {

// Between attempts to do what failed for a reason that may pass: etcd is away, a port not free yet.
constexpr std::chrono::milliseconds kCandidatePause{200};

// The reason stays until somebody does something about it.
bool IsLasting(const absl::Status& status) {
  return absl::IsFailedPrecondition(status) || absl::IsDataLoss(status) || absl::IsInvalidArgument(status) ||
         absl::IsInternal(status);
}

}  // namespace

Candidate::Candidate(const EtcdClient& client, std::string prefix, const LeaderAddress& self, ReignSettings settings,
                     ControlMetrics& metrics, const Pages& pages, ElectionTimes times)
    : client_(client),
      prefix_(std::move(prefix)),
      settings_(std::move(settings)),
      metrics_(metrics),
      pages_(pages),
      election_(client, prefix_, self, times) {}

absl::Status Candidate::Run(const std::function<bool()>& ended, const std::function<absl::Status()>& ready) {
  ready_ = ready;
  while (!ended()) {
    const auto fence = Follow(ended);
    if (absl::IsCancelled(fence.status())) break;
    if (!fence.ok()) return fence.status();
    if (absl::Status status = Lead(*fence, ended); !status.ok()) return status;
  }
  return absl::OkStatus();
}

absl::Status Candidate::Ready() { return ready_ ? std::exchange(ready_, nullptr)() : absl::OkStatus(); }

// --- Following.

absl::StatusOr<EtcdFence> Candidate::Follow(const std::function<bool()>& ended) {
  absl::Status lasting;
  const auto followed = [this](const std::optional<LeaderAddress>& leader) {
    const std::lock_guard lock(mutex_);
    leader_ = leader;
    spdlog::info("follows leader={}", leader ? ToText(*leader) : "none");
  };
  // The doors open once the first leader of the cluster has stored its authority.
  std::string trouble;  // logged once
  const auto given_up = [&] {
    if (!doors_ && lasting.ok()) {
      absl::Status opened = OpenFollowersDoors();
      if (opened.ok() && doors_) opened = Ready();
      if (IsLasting(opened)) lasting = opened;
      if (!opened.ok() && std::exchange(trouble, std::string(opened.message())) != opened.message()) {
        spdlog::warn("doors not open yet error=\"{}\"", trouble);
      }
    }
    return !lasting.ok() || ended();
  };
  auto fence = election_.Campaign(followed, given_up);
  doors_.reset();
  if (!lasting.ok()) return lasting;
  return fence;
}

absl::Status Candidate::OpenFollowersDoors() {
  std::optional<Authority> authority;
  if (HasTcpDoor()) {
    const auto stored = ReadEtcdValue(client_, prefix_, kAuthorityKey);
    if (absl::IsNotFound(stored.status())) return absl::OkStatus();  // a new cluster; we may be the first to lead it
    if (!stored.ok()) return stored.status();
    auto opened = ReadAuthority(*stored, settings_.seal);
    if (!opened.ok()) return opened.status();
    authority = *std::move(opened);
  }
  auto doors = FollowerServer::Start(settings_.doors, authority, metrics_, [this] {
    const std::lock_guard lock(mutex_);
    return leader_;
  });
  if (!doors.ok()) return doors.status();
  doors_ = *std::move(doors);
  return absl::OkStatus();
}

// --- Leading.

// OK when another is to lead, or after `ended`.
absl::Status Candidate::Lead(const EtcdFence& fence, const std::function<bool()>& ended) {
  spdlog::info("elected token={}", fence.token);
  const auto store = EtcdStore::Open(client_, prefix_, fence, [this] { election_.Abandon(); });
  absl::Status status = store.status();
  if (status.ok()) {
    const LeaderRights rights{.leads = [this] { return election_.Left() > EtcdElection::Clock::duration::zero(); },
                              .proves_lead = [this] { return election_.Confirm(kLeaseProofPatience); }};
    const auto reign = Reign::Begin(**store, settings_, metrics_, pages_, rights);
    status = reign.status();
    if (status.ok()) status = Ready();
    if (status.ok()) {
      election_.SetServing(true);
      election_.WaitUntilLost(ended);
      // Doors that close in good order are no sign of a death.
      if (election_.Left() > EtcdElection::Clock::duration::zero()) election_.SetServing(false);
    }
  }
  const bool deposed = election_.Left() <= EtcdElection::Clock::duration::zero();
  election_.Resign();
  spdlog::info("leads no more token={} error=\"{}\"", fence.token, std::string(status.message()));
  // Whoever was deposed in the middle of beginning says no more about the store.
  if (IsLasting(status) && !deposed) return status;
  if (!status.ok()) std::this_thread::sleep_for(kCandidatePause);
  return absl::OkStatus();
}

}  // namespace tessera::control
