// SupervisorTest: carries a supervisor's actions out against a world of its own, for tests: processes are numbers, time
// is what the test says.
#pragma once

#include <gmock/gmock.h>

#include <chrono>
#include <csignal>
#include <map>
#include <string>
#include <variant>
#include <vector>

#include "agent/supervisor.h"

namespace tessera::agent {

inline constexpr auto kStart = TimePoint(std::chrono::hours(1));
inline const std::string kHash(64, 'a'), kGameHash(64, 'b');
inline const Content kScene{ContentKind::kScene, kHash}, kGame{ContentKind::kGame, kGameHash};

class SupervisorTest : public ::testing::Test {
 protected:
  static v1::WorkerOrder Order(std::uint32_t region, std::uint64_t revision = 1) {
    v1::WorkerOrder order;
    order.set_revision(revision);
    order.set_instance_id("inst-1");
    order.set_region(region);
    order.set_incarnation(region + 10);
    order.set_scene_hash(kHash);
    return order;
  }
  static v1::WorkerOrder OrderWithGame(std::uint32_t region) {
    v1::WorkerOrder order = Order(region);
    order.set_game_hash(kGameHash);
    return order;
  }
  static WorkerKey Key(std::uint32_t region) { return {"inst-1", region, region + 10}; }

  std::vector<OrderOutcome> Want(const std::vector<v1::WorkerOrder>& orders) {
    v1::DesiredSet set;
    set.set_revision(++revision_);
    for (const auto& order : orders) *set.add_workers() = order;
    auto outcomes = supervisor_.Desired(set, now_);
    Carry();
    return outcomes;
  }

  v1::WorkerReport Report(std::uint32_t region, v1::WorkerPhase phase = v1::WORKER_PHASE_LOADING) const {
    v1::WorkerReport report;
    report.mutable_identity()->set_instance_id("inst-1");
    report.mutable_identity()->set_region(region);
    report.mutable_identity()->set_incarnation(region + 10);
    const auto pid = pids_.find(Key(region));
    report.mutable_identity()->set_pid(pid == pids_.end() ? 0 : pid->second);
    report.set_phase(phase);
    return report;
  }
  pid_t PidOf(std::uint32_t region) const { return static_cast<pid_t>(Report(region).identity().pid()); }
  void Attach(std::uint32_t region) {
    ASSERT_TRUE(supervisor_.Attached(Report(region), PidOf(region)).ok());
    Carry();
  }
  void End(std::uint32_t region, const host::ExitStatus& status, std::vector<std::string> lines = {}) {
    pids_.erase(Key(region));
    supervisor_.Ended(Key(region), status, std::move(lines));
    Carry();
  }
  void Pass(Duration time) {
    now_ += time;
    supervisor_.Tick(now_);
    Carry();
  }

  void Carry() {
    for (auto actions = supervisor_.TakeActions(); !actions.empty(); actions = supervisor_.TakeActions()) {
      for (const Action& action : actions) std::visit([this](const auto& a) { Do(a); }, action);
    }
  }
  void Do(const SpawnWorker& a) {
    spawned_.push_back(a.first_port);
    releases_.push_back(a.release);
    if (!spawn_error_.empty()) return supervisor_.SpawnFailed(a.key, spawn_error_);
    pids_[a.key] = ++last_pid_;
    supervisor_.Spawned(a.key, last_pid_, 7, "log", now_);
  }
  void Do(const SignalWorker& a) { signals_.push_back(a.signal); }
  void Do(const SendOrder& a) { orders_.push_back(a.order); }
  void Do(const KeepOrder& a) { kept_[a.key] = a.order; }
  void Do(const FetchContent& a) { fetches_.push_back(a.content.hash); }
  void Do(const FetchState& a) { states_.push_back(a); }
  void Do(const UploadState& a) { uploads_.push_back(a); }
  void Do(const ForwardReport& a) { reports_.push_back(a.report); }
  void Do(const ReportExit& a) {
    exits_.push_back(a.exited);
    results_.push_back(a.result);
  }

  TimePoint now_ = kStart;
  std::uint64_t revision_ = 0;
  pid_t last_pid_ = 1000;
  std::string spawn_error_;
  std::vector<std::string> releases_;  // with which workers were spawned
  std::map<WorkerKey, pid_t> pids_;
  std::vector<std::uint16_t> spawned_;
  std::vector<int> signals_;
  std::vector<v1::WorkerOrder> orders_;
  std::map<WorkerKey, v1::WorkerOrder> kept_;
  std::vector<std::string> fetches_;
  std::vector<v1::WorkerReport> reports_;
  std::vector<FetchState> states_;
  std::vector<UploadState> uploads_;
  std::vector<v1::WorkerExited> exits_;
  std::vector<ExitResult> results_;
  Supervisor supervisor_{PortRange(7800, 8799), [](std::uint16_t) { return true; }};
};

}  // namespace tessera::agent
