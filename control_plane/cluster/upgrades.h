// Upgrades: a world goes over to the programs that its hosts have now. Workers of two releases do not play one world,
// so all of it stands after one tick, is kept, and begins anew from there: no tick is lost, and players come back to
// it.
//
// Here is the wish, in the record, and its end. Making the checkpoint and beginning anew are ControlPlane's, which has
// the files. A control plane that finds an upgrade of one before it lets the world go on as it was.
//
// Thread rule: as Cluster.
#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>

#include "absl/status/statusor.h"
#include "control_plane/cluster/cluster_state.h"
#include "control_plane/now.h"

namespace tessera::control {

class Upgrades {
 public:
  void Forget(std::uint64_t number) { under_way_.erase(number); }

  // The record of a RUNNING instance that is to stand. FAILED_PRECONDITION: it is being upgraded already.
  static absl::StatusOr<std::optional<records::Instance>> Begin(const InstanceEntry& instance, Now now);
  // It is stored, and this control plane carries it out.
  void Begun(std::uint64_t number) { under_way_.insert(number); }
  // The tick after which all of it stands; nothing while it does not, or is not being upgraded.
  static std::optional<std::uint64_t> Tick(const InstanceEntry& instance);
  // The record without the wish: the world goes on, unless it was paused before. `text`: for an event. Nothing: it is
  // not being upgraded.
  std::optional<records::Instance> End(const InstanceEntry& instance, const std::string& text, Now now);
  // The same, where nobody carries the upgrade out any more.
  std::optional<records::Instance> EndAbandoned(const InstanceEntry& instance, Now now);

 private:
  std::set<std::uint64_t> under_way_;  // by instance number: those of this control plane
};

}  // namespace tessera::control
