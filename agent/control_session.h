// ControlSession: being a host of the control plane, for as long as this program runs.
//
// Dials, says hello, is admitted, beats, and when the stream ends dials again, for ever. Of several control planes it
// dials one after the other until it is admitted by the one that leads. Each change between connected and away is
// logged once. Only a refusal (wrong or used token, wrong secret, host removed) ends it.
//
// Thread rule: the event loop's thread, which also runs the callbacks.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "agent/control_link.h"
#include "agent/event_loop.h"
#include "agent/life_fence.h"

namespace tessera::agent {

class ControlSession {
 public:
  struct Callbacks {
    std::function<v1::AgentHello()> hello;
    std::function<trust::Credentials()> credentials;  // for each dial
    std::function<v1::AgentHeartbeat()> heartbeat;
    std::function<void(const v1::Admitted&)> on_admitted;
    std::function<void(const v1::DesiredSet&)> on_desired;
    std::function<void(const v1::LeaseRenewal&)> on_lease;
    std::function<void()> on_away;
    // Orders of a later life than any before came. They are given to `on_desired` once this has returned.
    std::function<void(std::uint64_t life)> on_life;
    std::function<void(const absl::Status&)> on_refused;  // the session is over
  };
  // `addresses`: as trust::ParseControlAddresses takes them. `newest_life`: that this host has seen.
  ControlSession(std::shared_ptr<EventLoop> loop, const std::string& addresses, std::uint64_t newest_life,
                 Callbacks callbacks);
  ~ControlSession();

  void Start() { Dial(); }
  // The link ends, and a new one begins with the credentials and the hello of now.
  void Redial();
  // Dropped unless admitted: whatever counts is sent again on admission.
  void Send(v1::AgentMessage message);
  // The link while admitted, else null.
  const std::shared_ptr<ControlLink>& link() const { return admitted_link_; }
  // Ends in order: what was sent goes out. `closed` follows after kFarewell at most.
  void Close(std::function<void()> closed);

 private:
  void Dial();
  void OnMessage(const v1::ControlMessage& message);
  void OnAdmitted(const v1::Admitted& admitted);
  void OnClosed(const absl::Status& status);
  bool AdmitLifeOf(const v1::DesiredSet& set);
  void Beat();
  void SetTimer(TimePoint when, EventLoop::Callback callback);
  Duration NextBackoff();
  const std::string& address() const { return addresses_[at_]; }
  bool several() const { return addresses_.size() > 1; }

  std::shared_ptr<EventLoop> loop_;
  std::vector<std::string> addresses_;  // addresses of the control planes, at least one
  std::size_t at_ = 0;                  // the one that is dialled
  LifeFence lives_;
  Callbacks callbacks_;
  // Callbacks of links hold a weak one, with the number of their dial: what an old link says is not heard.
  std::shared_ptr<ControlSession*> alive_;
  std::uint64_t dial_ = 0;
  std::shared_ptr<ControlLink> link_, admitted_link_;
  std::optional<EventLoop::TimerId> timer_;
  Duration heartbeat_interval_{}, backoff_ = kFirstBackoff;
  enum class Known { kNothing, kConnected, kAway } known_ = Known::kNothing;  // as last logged
  std::function<void()> closed_;
  std::minstd_rand random_;
};

}  // namespace tessera::agent
