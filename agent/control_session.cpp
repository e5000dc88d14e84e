#include "agent/control_session.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "spdlog/spdlog.h"
#include "telemetry/logging.h"
#include "trust/control_address.h"

namespace tessera::agent {
namespace {

using telemetry::LogValue;

// No further attempt mends these. A hello whose form is wrong counts before the first admission only (see OnClosed).
bool IsRefusal(const absl::Status& status) {
  return absl::IsUnauthenticated(status) || absl::IsPermissionDenied(status);
}
bool IsBadHello(const absl::Status& status) {
  return absl::IsInvalidArgument(status) || absl::IsFailedPrecondition(status) || absl::IsUnimplemented(status);
}

// One that cannot be read stays as it is: dialling it says why.
std::vector<std::string> Parted(const std::string& addresses) {
  const auto parsed = trust::ParseControlAddresses(addresses, host::PortRule::kFrom1);
  if (!parsed.ok()) return {addresses};
  std::vector<std::string> parts;
  for (const trust::ControlAddress& address : *parsed) parts.push_back(address.text());
  return parts;
}

}  // namespace

ControlSession::ControlSession(std::shared_ptr<EventLoop> loop, const std::string& addresses, std::uint64_t newest_life,
                               Callbacks callbacks)
    : loop_(std::move(loop)),
      addresses_(Parted(addresses)),
      lives_(newest_life),
      callbacks_(std::move(callbacks)),
      alive_(std::make_shared<ControlSession*>(this)),
      random_(std::random_device{}()) {}

ControlSession::~ControlSession() {
  if (timer_) loop_->Cancel(*timer_);
  if (link_) link_->Cancel();
}

void ControlSession::Dial() {
  const std::uint64_t dial = ++dial_;
  // From gRPC's threads to ours; by then this session, or this dial of it, may be history.
  const auto relay = [loop = loop_, weak = std::weak_ptr(alive_), dial](auto deliver) {
    loop->Post([weak, dial, deliver = std::move(deliver)] {
      const auto session = weak.lock();
      if (session && (*session)->dial_ == dial) deliver(**session);
    });
  };
  ControlLink::Callbacks callbacks;
  callbacks.on_message = [relay](v1::ControlMessage message) {
    relay([message = std::move(message)](ControlSession& session) { session.OnMessage(message); });
  };
  callbacks.on_closed = [relay](const absl::Status& status) {
    relay([status](ControlSession& session) { session.OnClosed(status); });
  };
  auto link =
      ControlLink::Dial(address(), callbacks_.credentials(), callbacks_.hello(), std::move(callbacks), several());
  if (!link.ok()) {
    return relay([status = link.status()](ControlSession& session) { session.OnClosed(status); });
  }
  link_ = *std::move(link);
  SetTimer(Clock::now() + (several() ? kLeaderAdmissionTimeout : kAdmissionTimeout), [this] { link_->Cancel(); });
}

void ControlSession::Redial() {
  if (link_) link_->Cancel();
  link_.reset();
  admitted_link_.reset();
  Dial();  // nothing that the old link still reports is heard
}

void ControlSession::Send(v1::AgentMessage message) {
  if (admitted_link_) admitted_link_->Send(std::move(message));
}

void ControlSession::OnMessage(const v1::ControlMessage& message) {
  if (message.has_admitted()) {
    OnAdmitted(message.admitted());
  } else if (message.has_desired() && admitted_link_) {
    if (!AdmitLifeOf(message.desired())) return link_->Cancel();
    callbacks_.on_desired(message.desired());
  } else if (message.has_lease() && admitted_link_) {
    callbacks_.on_lease(message.lease());
  } else {
    spdlog::warn("message ignored from=control kind={} admitted={}", static_cast<int>(message.kind_case()),
                 admitted_link_ != nullptr);
  }
}

bool ControlSession::AdmitLifeOf(const v1::DesiredSet& set) {
  if (!several()) return true;
  const std::uint64_t before = lives_.newest();
  if (!lives_.Admit(set.revision())) {
    spdlog::warn("desired set refused at={} revision={} newest_life={}: of a control plane that was deposed",
                 LogValue(address()), set.revision(), before);
    return false;
  }
  if (lives_.newest() > before) callbacks_.on_life(lives_.newest());
  return true;
}

void ControlSession::OnAdmitted(const v1::Admitted& admitted) {
  const std::uint32_t asked = admitted.heartbeat_interval_ms();
  heartbeat_interval_ = std::chrono::milliseconds(std::clamp(asked, kMinHeartbeat_ms, kMaxHeartbeat_ms));
  backoff_ = kFirstBackoff;
  admitted_link_ = link_;
  known_ = Known::kConnected;
  spdlog::info("control plane connected at={} host_id={} host_name={} heartbeat_ms={}", LogValue(address()),
               LogValue(admitted.host_id()), LogValue(admitted.host_name()), asked);
  callbacks_.on_admitted(admitted);
  // Not at once: the hello has said all.
  if (admitted_link_) SetTimer(Clock::now() + heartbeat_interval_, [this] { Beat(); });
}

void ControlSession::Beat() {
  v1::AgentMessage message;
  *message.mutable_heartbeat() = callbacks_.heartbeat();
  Send(std::move(message));
  SetTimer(Clock::now() + heartbeat_interval_, [this] { Beat(); });
}

void ControlSession::OnClosed(const absl::Status& status) {
  if (timer_) loop_->Cancel(*timer_);
  timer_.reset();
  link_.reset();
  const bool was_admitted = std::exchange(admitted_link_, nullptr) != nullptr;
  if (closed_) return std::exchange(closed_, nullptr)();
  if (IsRefusal(status) || (known_ != Known::kConnected && IsBadHello(status))) {
    return callbacks_.on_refused(status);
  }
  if (known_ != Known::kAway) {
    known_ = Known::kAway;
    const std::string why = status.ok() ? "the stream was ended" : std::string(status.message());
    spdlog::warn("control plane away at={} reason={}; workers run on, trying again", LogValue(address()),
                 LogValue(why));
  }
  if (was_admitted) callbacks_.on_away();
  // The next one may lead. Only when all have been tried is there a pause that grows.
  at_ = (at_ + 1) % addresses_.size();
  SetTimer(Clock::now() + (at_ == 0 ? NextBackoff() : Duration::zero()), [this] { Dial(); });
}

void ControlSession::Close(std::function<void()> closed) {
  if (!link_ || !admitted_link_) return closed();
  closed_ = std::move(closed);
  link_->Close();
  SetTimer(Clock::now() + kFarewell, [this] { link_->Cancel(); });
}

void ControlSession::SetTimer(TimePoint when, EventLoop::Callback callback) {
  if (timer_) loop_->Cancel(*timer_);
  timer_ = loop_->RunAt(when, [this, callback = std::move(callback)] {
    timer_.reset();
    callback();
  });
}

Duration ControlSession::NextBackoff() {
  const Duration full = std::exchange(backoff_, std::min(2 * backoff_, kLastBackoff));
  return full - full / 5 * std::uniform_int_distribution<int>(0, 100)(random_) / 100;
}

}  // namespace tessera::agent
