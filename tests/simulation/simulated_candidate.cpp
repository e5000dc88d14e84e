// How a simulated control plane comes to lead and ceases to, as control_plane/candidate.h and etcd/etcd_election.h have
// it.
#include <algorithm>

#include "control_plane/control_settings.h"
#include "tests/simulation/simulated_control.h"

namespace tessera::simulation {

// Its doors are open, for what is asked there: who leads.
void SimulatedControl::Follow() {
  ++life_;
  token_ = 0;
  deposed_ = look_is_due_ = false;
  network_.Join(node(), {.on_connected = [](Node) {},
                         .on_disconnected = [](Node) {},
                         .on_message = [this](Node from, const Bytes&) { network_.Break(from, node()); },
                         .on_datagram = {}});
  UpdateStall();
  Campaign();
}

void SimulatedControl::Campaign() {
  timeline_.In(kElectionPoll, [this, life = life_] {
    if (!running_ || life != life_) return;
    network_.InProcess(node(), [this, life] {
      if (!running_ || life != life_) return;
      const std::int64_t token = ReachesStore() ? shared_.Campaign(number_) : 0;
      if (token == 0) return Campaign();
      steps_down_at_ = timeline_.now() + kStepDownAfter;
      renews_at_ = timeline_.now() + kRenewAfter;
      Lead(token);
    });
  });
}

void SimulatedControl::WatchElection() {
  timeline_.At(std::min(renews_at_, steps_down_at_), [this, life = life_] {
    if (!alive() || life != life_) return;
    look_is_due_ = stopped_;
    if (!stopped_) LookAtElection();
  });
}

// A thread of its own looks, so that no write holds it up.
void SimulatedControl::LookAtElection() {
  const Micros now = timeline_.now();
  if (now >= steps_down_at_) return EndReign("the lease could not be renewed in time");
  if (!ReachesStore()) {
    renews_at_ = now + kElectionPoll;
  } else if (shared_.Renew(token_)) {
    steps_down_at_ = now + kStepDownAfter;
    renews_at_ = now + kRenewAfter;
  } else {
    return EndReign("the lease is over");
  }
  WatchElection();
}

// A write under way ends first: the lock is held.
void SimulatedControl::EndReign(const std::string& why) {
  log_.push_back("leads no more: " + why);
  deposed_ = true;
  if (!writing()) StepDown();
}

void SimulatedControl::StepDown() {
  const std::int64_t token = token_;
  Drop();
  if (ReachesStore()) shared_.Resign(token);
  Follow();
}

// --- Workers' leases, as control_plane/lease_proof.h has them.

void SimulatedControl::AskLease(control::StreamId session, const v1::LeaseRequest& request) {
  asked_leases_.Put(session, request);
  ProveLead();
}

// The worst order: the store says how things stand when it is asked, and the answer comes as late as it can.
void SimulatedControl::ProveLead() {
  if (!asked_leases_.Begin()) return;
  const bool asked = ReachesStore();
  const bool leads = asked && shared_.token() == token_;
  const Micros takes = asked ? shared_.read_time() : MicrosOf(control::kLeaseProofPatience);
  timeline_.In(takes, [this, life = life_, asked, leads] {
    if (!alive() || life != life_) return;
    network_.InProcess(node(), [this, life, asked, leads] {
      if (alive() && life == life_) Proved(asked && ReachesStore(), leads);
    });
  });
}

void SimulatedControl::Proved(bool answered, bool leads) {
  const std::uint64_t life = life_;
  for (const control::AskedLeases::Asked& asked : asked_leases_.End(answered && leads)) {
    v1::AgentMessage message;
    *message.mutable_lease() = asked.request;
    // It fails for an agent that has gone.
    cluster_->HandleAgentMessage(Now(), asked.stream, message).IgnoreError();
    Publish();
    if (!alive() || life != life_) return;
  }
  if (answered && !leads) return EndReign("the lease is over");
  ProveLead();
}

}  // namespace tessera::simulation
