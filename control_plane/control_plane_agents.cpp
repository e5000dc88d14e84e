// ControlPlane's part in agents' streams: what goes out and comes in, and leases that wait for a proof of the lead.
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "control_plane/control_plane.h"
#include "control_plane/report_limits.h"

namespace tessera::control {

absl::StatusOr<std::shared_ptr<ControlPlane::AgentStream>> ControlPlane::Attach(const v1::AgentHello& hello,
                                                                                std::function<void()> cancel,
                                                                                const std::string& shown_serial) {
  const std::lock_guard lock(mutex_);
  if (stopping_) return absl::UnavailableError("the control plane is ending");
  const auto admission = cluster_->HandleHello(ReadClocks(), hello, shown_serial);
  if (!admission.ok()) {
    Publish();
    return admission.status();
  }
  auto stream = std::make_shared<AgentStream>();
  stream->id = admission->stream;
  stream->admitted = admission->admitted;
  stream->certificate_serial = admission->serial;
  stream->cancel = std::move(cancel);
  streams_[stream->id] = stream;
  Publish();
  return stream;
}

void ControlPlane::Detach(AgentStream& stream) {
  const std::lock_guard lock(mutex_);
  cluster_->HandleAgentGone(stream.id);
  if (!stream.closed) stream.closed = absl::CancelledError("the agent has gone");
  stream.wake.notify_all();
  streams_.erase(stream.id);
  Publish();
}

std::optional<v1::ControlMessage> ControlPlane::NextMessage(AgentStream& stream) {
  UrgentLock lock(urgent_);
  v1::ControlMessage message;
  while (true) {
    stream.wake.wait(lock, [&stream] { return stream.desired || stream.closed || !stream.leases.empty(); });
    if (stream.closed) return std::nullopt;
    // Whoever was deposed may hold orders that the new leader has replaced.
    if (!rights_.leads()) {
      stream.closed = absl::UnavailableError("this control plane no longer leads");
      stream.cancel();
      return std::nullopt;
    }
    if (std::optional<v1::LeaseRenewal> lease = stream.leases.Take()) {
      message.mutable_lease()->Swap(&*lease);
      return message;
    }
    stream.desired = false;
    std::optional<v1::DesiredSet> desired = cluster_->TakeDesired(stream.id);
    Publish();
    if (!desired) continue;
    message.mutable_desired()->Swap(&*desired);
    return message;
  }
}

absl::Status ControlPlane::HandleAgentMessage(AgentStream& stream, const v1::AgentMessage& message) {
  if (message.has_lease() && lease_proof_) {
    if (absl::Status status = CheckMessage(message); !status.ok()) return status;
    lease_proof_->Ask(stream.id, message.lease());
    return absl::OkStatus();
  }
  const UrgentLock lock(urgent_);
  absl::Status status = cluster_->HandleAgentMessage(ReadClocks(), stream.id, message);
  Publish();
  return status;
}

// Asked for before it was proved that we lead: else a worker could step beside the one that the next leader promotes.
void ControlPlane::GiveLease(const AskedLeases::Asked& asked) {
  v1::AgentMessage message;
  *message.mutable_lease() = asked.request;
  const UrgentLock lock(urgent_);
  if (stopping_ || !streams_.contains(asked.stream)) return;
  // It fails for a stream alone that another one has replaced, and whose end has been told.
  cluster_->HandleAgentMessage(ReadClocks(), asked.stream, message).IgnoreError();
  Publish();
}

}  // namespace tessera::control
