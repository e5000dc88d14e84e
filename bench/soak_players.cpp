#include "bench/soak_players.h"

#include <fmt/format.h>

#include <chrono>
#include <csignal>
#include <iostream>
#include <utility>
#include <vector>

#include "host/last_lines.h"
#include "local_cluster/command_error.h"
#include "local_cluster/local_cluster.h"

namespace tessera::bench {
namespace {

constexpr std::chrono::seconds kLeaving{30};
constexpr std::uint64_t kMostGroupsFailed = 20;  // then it is no chance, and starting more would go on for ever

}  // namespace

SoakPlayers::~SoakPlayers() {
  for (const Group& group : groups_) group.process.Signal(SIGTERM);  // all at once; then each is waited for
}

void SoakPlayers::Join(std::size_t groups) {
  for (std::size_t i = 0; i < groups; ++i) {
    const std::uint64_t number = ++started_;
    const std::string log = fmt::format("{}/{}", folder_.path(), number);
    auto process = local::OrThrow(host::ChildProcess::Start(
        {.argv = {local::ProgramPath("tessera"), "--control", control_address_, "-o", "json", "swarm", instance_,
                  "--players", std::to_string(kInGroup), "--name", fmt::format("soak-{}", number), "--seed",
                  std::to_string(number * kInGroup)},
         .log_path = log}));
    groups_.push_back({std::move(process), log});
    joins_ += kInGroup;
  }
}

void SoakPlayers::NoteFailure(const Group& group, const std::string& how) {
  ++failed_;
  std::cerr << fmt::format("soak: a group of players {}{}\n", how, host::LastLinesText(group.log, 2));
}

void SoakPlayers::Leave(std::size_t groups) {
  for (std::size_t i = 0; i < groups && i < groups_.size(); ++i) groups_[i].process.Signal(SIGTERM);
  for (std::size_t i = 0; i < groups && !groups_.empty(); ++i) {
    Group& group = groups_.front();
    const auto ended = group.process.Wait(kLeaving);
    if (!ended || !ended->Clean()) NoteFailure(group, ended ? ended->Describe() : "did not leave");
    groups_.pop_front();
  }
}

void SoakPlayers::Look() {
  std::size_t gone = 0;
  for (auto group = groups_.begin(); group != groups_.end();) {
    const auto ended = group->process.Wait(std::chrono::milliseconds(0));
    if (!ended) {
      ++group;
      continue;
    }
    NoteFailure(*group, ended->Describe() + " unasked");
    group = groups_.erase(group);
    ++gone;
  }
  if (failed_ > kMostGroupsFailed) throw local::CommandError("players do not stay in " + instance_);
  Join(gone);
}

}  // namespace tessera::bench
