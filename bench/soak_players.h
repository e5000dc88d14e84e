// SoakPlayers: players of the suite soak, in groups that come and go, each a process of `tessera swarm`.
//
// CommandError where a program cannot be started, or too many groups have failed. Destruction ends all of them. Thread
// rule: one thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <string>
#include <utility>

#include "host/child_process.h"
#include "host/temporary_folder.h"

namespace tessera::bench {

class SoakPlayers {
 public:
  static constexpr std::uint32_t kInGroup = 5;

  SoakPlayers(std::string control_address, std::string instance)
      : control_address_(std::move(control_address)), instance_(std::move(instance)) {}
  ~SoakPlayers();
  SoakPlayers(const SoakPlayers&) = delete;
  SoakPlayers& operator=(const SoakPlayers&) = delete;

  // So many groups more are on their way in.
  void Join(std::size_t groups);
  // The oldest leave in order, and are waited for.
  void Leave(std::size_t groups);
  // Writes down groups that ended unasked, and starts others in their place.
  void Look();

  std::size_t groups() const { return groups_.size(); }
  std::uint32_t wanted() const { return kInGroup * static_cast<std::uint32_t>(groups_.size()); }
  std::uint64_t joins() const { return joins_; }
  // Groups that could not join, lost a player, or did not leave in order.
  std::uint64_t failed() const { return failed_; }

 private:
  struct Group {
    host::ChildProcess process;
    std::string log;
  };
  void NoteFailure(const Group& group, const std::string& how);

  std::string control_address_, instance_;
  host::TemporaryFolder folder_;
  std::deque<Group> groups_;  // oldest first
  std::uint64_t joins_ = 0, started_ = 0, failed_ = 0;
};

}  // namespace tessera::bench
