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

bool SimulatedControl::RenewsLeases() const {
  if (!several_) return true;
  const Micros spared = MicrosOf(control::kLeaseTtl + control::kLeaseDrift);
  return MaySend() && steps_down_at_ > timeline_.now() + spared;
}

}  // namespace tessera::simulation
