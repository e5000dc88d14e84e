// Groups in a folder that stands in for the kernel's, and, where this machine lets us, in the kernel's own.
#include "host/cgroup.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>

#include "host/files.h"
#include "host/process.h"
#include "host/temporary_folder.h"

namespace tessera::host {
namespace {

using ::testing::HasSubstr;

class CgroupTest : public ::testing::Test {
 protected:
  CgroupTest() {
    std::filesystem::create_directories(Unit());
    Write(Unit() + "/cgroup.controllers", "cpu memory pids\n");
    Write(Membership(), "1:name=systemd:/other\n0::/system.slice/agent.service\n");
  }
  std::string Unit() const { return folder_.path() + "/system.slice/agent.service"; }
  std::string Membership() const { return folder_.path() + "/membership"; }
  static void Write(const std::string& path, const std::string& text) { std::ofstream(path) << text; }
  static std::string Read(const std::string& path) { return ReadFile(path, 1000).value_or("none"); }
  absl::StatusOr<DelegatedCgroup> Open() const { return DelegatedCgroup::Open(folder_.path(), Membership()); }

  const TemporaryFolder folder_;
};

TEST_F(CgroupTest, ThisProcessMakesRoomAndEachOtherGetsItsLimits) {
  const auto groups = Open();
  ASSERT_TRUE(groups.ok()) << groups.status();
  EXPECT_EQ(groups->path(), Unit());
  EXPECT_EQ(Read(Unit() + "/agent/cgroup.procs"), "0") << "the kernel takes it for whoever writes";
  EXPECT_EQ(Read(Unit() + "/cgroup.subtree_control"), "+memory +pids");
  const auto made = groups->Make("worker-7", {.memory_bytes = 1 << 30, .tasks = 512});
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_EQ(*made, Unit() + "/worker-7");
  EXPECT_EQ(Read(*made + "/memory.max"), "1073741824");
  EXPECT_EQ(Read(*made + "/pids.max"), "512");
  EXPECT_EQ(Read(*made + "/memory.oom.group"), "1");
  EXPECT_EQ(Read(*groups->Make("worker-8", {}) + "/pids.max"), "max");
}

TEST_F(CgroupTest, EmptyGroupsOfEarlierLivesAreRemovedAndOthersStay) {
  std::filesystem::create_directories(Unit() + "/worker-1");
  std::filesystem::create_directories(Unit() + "/worker-2/stands-for-a-process");
  ASSERT_TRUE(Open().ok());
  EXPECT_FALSE(std::filesystem::exists(Unit() + "/worker-1"));
  EXPECT_TRUE(std::filesystem::exists(Unit() + "/worker-2"));
}

TEST_F(CgroupTest, WhatIsMissingIsNamed) {
  Write(Unit() + "/cgroup.controllers", "cpu memory\n");
  EXPECT_THAT(std::string(Open().status().message()), HasSubstr("has no controller `pids`"));
  Write(Membership(), "4:memory:/older\n");
  EXPECT_EQ(Open().status(), absl::FailedPreconditionError("cgroup v2: this process is in none of its groups"));
}

TEST_F(CgroupTest, AProcessIsInItsGroupBeforeItsProgramRuns) {
  const std::string group = folder_.path() + "/group";
  std::filesystem::create_directories(group);
  const auto process = Process::Spawn({.argv = {"/bin/cat", group + "/cgroup.procs"},
                                       .log_path = folder_.path() + "/log",
                                       .parent_death_signal = SIGKILL,
                                       .cgroup = group});
  ASSERT_TRUE(process.ok()) << process.status();
  ASSERT_TRUE(process->WaitUntilEnded(std::chrono::seconds(60)));
  EXPECT_TRUE(process->Reap().Clean());
  EXPECT_EQ(Read(folder_.path() + "/log"), "0");
}

TEST_F(CgroupTest, AGroupThatIsNotThereIsAnErrorByName) {
  const auto process =
      Process::Spawn({.argv = {"/bin/true"}, .log_path = folder_.path() + "/log", .cgroup = folder_.path() + "/none"});
  EXPECT_EQ(process.status().code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(process.status().message()), HasSubstr("/none"));
}

// By the kernel's own groups: a fork bomb and too much memory end in their group. It needs to be root, and memory and
// pids among the controllers of cgroup v2.
TEST(KernelCgroupTest, AForkBombAndTooMuchMemoryEndInTheirGroup) {
  const std::string root = "/sys/fs/cgroup";
  const std::string controllers = ReadFile(root + "/cgroup.subtree_control", 1000).value_or("");
  if (geteuid() != 0 || controllers.find("memory") == std::string::npos ||
      controllers.find("pids") == std::string::npos) {
    GTEST_SKIP() << "cgroup v2 here has no controllers of memory and pids for children, or this is not root";
  }
  const TemporaryFolder folder;
  const std::string unit = root + "/" + std::filesystem::path(folder.path()).filename().string();
  ASSERT_TRUE(std::filesystem::create_directory(unit));
  const DelegatedCgroup groups = DelegatedCgroup::At(unit);
  std::ofstream(unit + "/cgroup.subtree_control") << "+memory +pids";
  const auto run = [&](const std::string& name, const std::string& script) {
    const auto group = groups.Make(name, {.memory_bytes = 64 << 20, .tasks = 20});
    EXPECT_TRUE(group.ok()) << group.status();
    const auto process = Process::Spawn({.argv = {"/bin/sh", "-c", script},
                                         .log_path = folder.path() + "/" + name,
                                         .parent_death_signal = SIGKILL,
                                         .cgroup = *group});
    EXPECT_TRUE(process.ok()) << process.status();
    EXPECT_TRUE(process->WaitUntilEnded(std::chrono::seconds(120)));
    const ExitStatus status = process->Reap();
    groups.Remove(name);
    return status;
  };
  EXPECT_FALSE(run("bomb", "for i in $(seq 100); do sleep 20 & done; kill 0").Clean());
  EXPECT_THAT(ReadFile(folder.path() + "/bomb", 100'000).value(), HasSubstr("fork"));
  EXPECT_EQ(run("memory", "head -c 200000000 /dev/zero | tail").signal, SIGKILL);
  std::filesystem::remove(unit);
}

}  // namespace
}  // namespace tessera::host
