// The fixture of tests of the whole agent: the real program, a control plane on loopback, workers that misbehave
// on demand, and the promise that no process outlives a test.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "agent/testing/fake_control_plane.h"
#include "gtest/gtest.h"
#include "host/process.h"
#include "host/temporary_folder.h"
#include "host/testing/watched_program.h"

namespace tessera::agent {

class AgentFixture : public ::testing::Test {
 protected:
  AgentFixture();
  ~AgentFixture() override;

  // The agent on this test's state folder, on ports of its own; a flag in `extra` replaces the fixture's.
  // `around`: a command that runs it in its place, as env does.
  std::unique_ptr<host::WatchedProgram> StartAgent(const std::vector<std::string>& extra = {},
                                                   const std::vector<std::string>& around = {});
  // With the token, admitted.
  std::unique_ptr<host::WatchedProgram> StartAdmitted(const std::vector<std::string>& extra = {},
                                                      const std::vector<std::string>& around = {});
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

  host::TemporaryFolder temporary_;
  std::string folder_ = temporary_.path(), state_dir_, scene_hash_, port_range_;
  std::uint16_t first_port_ = 0;
  FakeControlPlane control_;

 private:
  std::vector<host::Process> held_;
};

inline host::ExitStatus Exited(int code) { return {.known = true, .code = code}; }

}  // namespace tessera::agent
