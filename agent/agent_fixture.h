// What tests of the whole agent share: the real program, a control plane on loopback, workers that can be told to
// misbehave, and the promise that no process outlives a test.
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "agent/fake_control_plane.h"
#include "agent/process.h"
#include "gtest/gtest.h"

namespace tessera::agent {

inline constexpr std::chrono::seconds kTestPatience{30};

// A program under test. Ended, by its pidfd, with this object.
class Program {
 public:
  Program(std::vector<std::string> argv, std::string log_path);
  ~Program();

  pid_t pid() const { return process_->pid(); }
  void Signal(int signal) const { process_->Signal(signal); }
  ExitStatus Wait();  // fails the test after kTestPatience
  bool Ended() const { return ended_.has_value(); }
  std::string Log() const;
  // Waits for a text in its output, which is a file: asked again each time the file grows.
  bool WaitForLog(const std::string& text) const;

 private:
  std::optional<Process> process_;
  std::string log_path_;
  std::optional<ExitStatus> ended_;
};

class AgentFixture : public ::testing::Test {
 protected:
  AgentFixture();
  ~AgentFixture() override;

  // The agent on this test's state folder, on ports of its own; a flag in `extra` replaces the fixture's.
  std::unique_ptr<Program> StartAgent(const std::vector<std::string>& extra = {});
  std::unique_ptr<Program> StartAdmitted(const std::vector<std::string>& extra = {});  // with the token, admitted
  void SetMode(int region, const std::string& mode);

  // An order for the test's scene, revision `revision`.
  v1::WorkerOrder Order(std::uint32_t region, std::uint64_t revision = 1, bool run = true) const;
  bool WaitForPhase(std::uint32_t region, v1::WorkerPhase phase);
  bool WaitForExits(std::size_t count);
  // Holds the worker processes that the control plane has heard of, so that they can be waited for and are killed at
  // the end of the test.
  std::vector<pid_t> HoldWorkers();
  bool WaitForWorkersToEnd();
  bool WorkersLive() const;

  std::string folder_, state_dir_, scene_hash_, port_range_;
  std::uint16_t first_port_ = 0;
  FakeControlPlane control_;

 private:
  std::vector<Process> held_;
  int starts_ = 0;
};

inline ExitStatus Exited(int code) { return {.known = true, .code = code}; }
// In a failed test's message.
void PrintTo(const ExitStatus& status, std::ostream* out);

bool WaitReadable(int fd, std::chrono::milliseconds patience = kTestPatience);

}  // namespace tessera::agent
