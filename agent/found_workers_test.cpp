#include "agent/found_workers.h"

#include <chrono>
#include <csignal>
#include <string>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "host/process.h"
#include "host/temporary_folder.h"

namespace tessera::agent {
namespace {

using ::testing::IsEmpty;

constexpr std::chrono::seconds kFoundTestPatience{20};

std::vector<std::string> Command(const std::string& socket) {
  return {"/usr/bin/tessera-region",
          "--agent-socket",
          socket,
          "--instance",
          "inst-7",
          "--region",
          "2",
          "--incarnation",
          "31",
          "--game-port",
          "30000",
          "--link-port",
          "30001",
          "--log-file",
          "/state/logs/inst-7-r2-i31.log"};
}

TEST(FoundWorkersTest, AWorkersArgumentsSayWhoItIs) {
  const auto record = WorkerOf(Command("/state/agent.sock"), "/state/agent.sock");
  ASSERT_TRUE(record);
  EXPECT_EQ(record->identity().instance_id(), "inst-7");
  EXPECT_EQ(record->identity().region(), 2u);
  EXPECT_EQ(record->identity().incarnation(), 31u);
  EXPECT_EQ(record->first_port(), 30000u);
  EXPECT_EQ(record->log_path(), "") << "a process may name any file there, such as a secret";
}

TEST(FoundWorkersTest, NeitherAnotherAgentsWorkerNorAnythingElseIsOne) {
  EXPECT_FALSE(WorkerOf(Command("/other/agent.sock"), "/state/agent.sock"));
  EXPECT_FALSE(WorkerOf({}, "/state/agent.sock"));
  for (const char* name : {"", "../../host", "inst 7", ".", "-7"}) {
    std::vector<std::string> command = Command("/state/agent.sock");
    command[4] = name;
    EXPECT_FALSE(WorkerOf(command, "/state/agent.sock")) << name;
  }
  EXPECT_FALSE(WorkerOf({"grep", "--agent-socket", "/state/agent.sock"}, "/state/agent.sock"));
  for (const std::size_t at : {6u, 8u, 10u}) {
    for (const char* value : {"", "0", "-1", "x", "99999999999999999999999"}) {
      std::vector<std::string> command = Command("/state/agent.sock");
      command[at] = value;
      EXPECT_FALSE(WorkerOf(command, "/state/agent.sock")) << command[at - 1] << " " << value;
    }
  }
}

TEST(FoundWorkersTest, ALiveProcessIsFoundWithItsPidAndStartAndNoneOnceItHasEnded) {
  const host::TemporaryFolder folder;
  const std::string socket = folder.path() + "/agent.sock";
  EXPECT_THAT(FindWorkers(socket), IsEmpty());
  std::vector<std::string> command = Command(socket);
  // The shell stands still, and takes the rest as arguments.
  command.front() = "worker";
  command.insert(command.begin(), {"/bin/sh", "-c", "kill -STOP $$"});
  const auto process = host::Process::Spawn({.argv = command, .log_path = folder.path() + "/log"});
  ASSERT_TRUE(process.ok()) << process.status();
  const std::vector<WorkerRecord> found = FindWorkers(socket);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].identity().pid(), process->pid());
  EXPECT_EQ(found[0].start_time(), process->start_time());
  process->Signal(SIGKILL);
  ASSERT_TRUE(process->WaitUntilEnded(kFoundTestPatience));
  (void)process->Reap();
  EXPECT_THAT(FindWorkers(socket), IsEmpty());
}

}  // namespace
}  // namespace tessera::agent
