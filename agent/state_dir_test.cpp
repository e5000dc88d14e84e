#include "agent/state_dir.h"

#include <sys/stat.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "agent/limits.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "host/log_rotation.h"
#include "host/temporary_folder.h"

namespace tessera::agent {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class StateDirTest : public ::testing::Test {
 protected:
  static unsigned Mode(const std::string& path) {
    struct stat info {};
    EXPECT_EQ(stat(path.c_str(), &info), 0) << path;
    return info.st_mode & 0777;
  }

  host::TemporaryFolder temporary_;
  std::string folder_ = temporary_.path();
};

TEST_F(StateDirTest, KeepsTheIdentityReadableToItselfAlone) {
  const std::string path = folder_ + "/new/state";
  const auto dir = StateDir::Open(path).value();
  EXPECT_EQ(Mode(path), 0700U);
  EXPECT_FALSE(dir->LoadIdentity().value());
  HostIdentity identity;
  identity.set_host_id("host-1");
  identity.set_host_secret("s");
  ASSERT_TRUE(dir->SaveIdentity(identity).ok());
  EXPECT_EQ(Mode(dir->IdentityPath()), 0600U);
  EXPECT_EQ(dir->LoadIdentity().value()->host_id(), "host-1");
}

TEST_F(StateDirTest, SecondHolderIsRefusedAndTheFolderIsFreeAfterTheFirst) {
  auto first = StateDir::Open(folder_);
  ASSERT_TRUE(first.ok());
  const auto second = StateDir::Open(folder_);
  EXPECT_EQ(second.status().code(), absl::StatusCode::kAlreadyExists);
  EXPECT_EQ(std::string(second.status().message()), "another agent runs on state folder " + folder_);
  first->reset();
  EXPECT_TRUE(StateDir::Open(folder_).ok());
}

TEST_F(StateDirTest, SocketPathLimitIsExactAndTheErrorSaysWhatToDo) {
  const std::size_t room = kMaxSocketPath - std::string("/agent.sock").size() - folder_.size() - 1;
  EXPECT_TRUE(StateDir::Open(folder_ + "/" + std::string(room, 'x')).ok());
  const std::string longer = folder_ + "/" + std::string(room + 1, 'x');
  const auto dir = StateDir::Open(longer);
  EXPECT_EQ(dir.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(dir.status().message()), HasSubstr(longer + "/agent.sock"));
  EXPECT_THAT(std::string(dir.status().message()), HasSubstr("shorter --state-dir"));
}

TEST_F(StateDirTest, DamagedFilesAreErrorsThatNameTheFile) {
  const auto dir = StateDir::Open(folder_).value();
  std::ofstream(folder_ + "/host.json") << "{\"host_id\": ";
  EXPECT_THAT(std::string(dir->LoadIdentity().status().message()), AllOf(HasSubstr("host.json"), Not(HasSubstr("\n"))));
  std::ofstream(folder_ + "/host.json") << "{\"host_id\": \"host-1\"}";
  EXPECT_THAT(std::string(dir->LoadIdentity().status().message()), HasSubstr("host_secret"));
  std::ofstream(folder_ + "/workers.json") << "[]";
  EXPECT_THAT(std::string(dir->LoadWorkers().status().message()), HasSubstr("workers.json"));
}

TEST_F(StateDirTest, AWorkersFileThatCannotBeReadIsOutOfTheWayAndKept) {
  const auto dir = StateDir::Open(folder_).value();
  std::ofstream(folder_ + "/workers.json") << "{\"boot_id\": \"b";
  EXPECT_FALSE(dir->LoadWorkers().ok());
  EXPECT_EQ(dir->SetWorkersAside(), folder_ + "/workers.json.unreadable");
  EXPECT_TRUE(fs::exists(folder_ + "/workers.json.unreadable"));
  EXPECT_EQ(dir->LoadWorkers()->workers_size(), 0);
}

TEST_F(StateDirTest, LogsBeforeThatOfARunningWorkerStay) {
  const auto dir = StateDir::Open(folder_).value();
  const std::string current = folder_ + "/logs/running.log";
  std::ofstream(host::EarlierLog(current, 1)) << "eldest";
  std::ofstream{current} << "newest";
  for (std::size_t i = 0; i < kKeptLogs + 20; ++i) std::ofstream(folder_ + "/logs/" + std::to_string(i)) << i;
  for (const auto& entry : fs::directory_iterator(folder_ + "/logs")) {
    if (entry.path() != host::EarlierLog(current, 1)) continue;
    fs::last_write_time(entry, fs::file_time_type::clock::now() - std::chrono::hours(1));
  }
  dir->PruneLogs({current});
  EXPECT_TRUE(fs::exists(current));
  EXPECT_TRUE(fs::exists(host::EarlierLog(current, 1)));
  const auto left = std::distance(fs::directory_iterator(folder_ + "/logs"), fs::directory_iterator());
  EXPECT_EQ(static_cast<std::size_t>(left), kKeptLogs + 2);
}

TEST_F(StateDirTest, WorkersComeBackAsWritten) {
  const auto dir = StateDir::Open(folder_).value();
  EXPECT_EQ(dir->LoadWorkers()->workers_size(), 0);
  WorkersFile file;
  file.set_boot_id("b");
  file.add_workers()->set_start_time(~std::uint64_t{0});  // beyond what a JSON number holds
  file.add_exits()->set_reason("line \"one\"\n");
  ASSERT_TRUE(dir->SaveWorkers(file).ok());
  EXPECT_EQ(dir->LoadWorkers()->SerializeAsString(), file.SerializeAsString());
}

TEST_F(StateDirTest, AnOrderComesBackAsWrittenUntilItIsForgotten) {
  const auto dir = StateDir::Open(folder_).value();
  v1::WorkerOrder order;
  order.set_instance_id("inst-7");
  order.set_region(2);
  order.set_incarnation(31);
  v1::WorkerIdentity worker;
  worker.set_instance_id("inst-7");
  worker.set_region(2);
  worker.set_incarnation(31);
  EXPECT_EQ(dir->LoadOrder(worker).value(), std::nullopt);
  for (const std::uint64_t revision : {1u, 2u}) {
    order.set_revision(revision);
    ASSERT_TRUE(dir->SaveOrder(worker, order).ok());
    EXPECT_EQ(dir->LoadOrder(worker).value()->SerializeAsString(), order.SerializeAsString());
  }
  EXPECT_EQ(Mode(dir->OrderPath(worker)), 0600U);
  dir->ForgetOrder(worker);
  EXPECT_EQ(dir->LoadOrder(worker).value(), std::nullopt);
}

TEST_F(StateDirTest, AnOrderOfAnotherWorkerAndADamagedOneAreErrorsThatNameTheFile) {
  const auto dir = StateDir::Open(folder_).value();
  v1::WorkerIdentity worker;
  worker.set_instance_id("inst-7");
  worker.set_region(2);
  worker.set_incarnation(31);
  v1::WorkerOrder other;
  other.set_instance_id("inst-8");
  ASSERT_TRUE(dir->SaveOrder(worker, other).ok());
  EXPECT_EQ(dir->LoadOrder(worker).status().code(), absl::StatusCode::kDataLoss);
  std::ofstream(dir->OrderPath(worker)) << "no order";
  EXPECT_THAT(std::string(dir->LoadOrder(worker).status().message()), HasSubstr("inst-7-r2-i31.pb"));
}

TEST_F(StateDirTest, PruningKeepsTheYoungestLogsAndThoseInUse) {
  const auto dir = StateDir::Open(folder_).value();
  for (std::size_t i = 0; i < kKeptLogs + 5; ++i) {
    const std::string path = folder_ + "/logs/" + std::to_string(i);
    std::ofstream(path) << i;
    fs::last_write_time(path, fs::file_time_type(std::chrono::seconds(i)));
  }
  dir->PruneLogs({folder_ + "/logs/0"});
  EXPECT_TRUE(fs::exists(folder_ + "/logs/0"));
  for (const int gone : {1, 2, 3, 4}) EXPECT_FALSE(fs::exists(folder_ + "/logs/" + std::to_string(gone)));
  EXPECT_TRUE(fs::exists(folder_ + "/logs/5"));
}

}  // namespace
}  // namespace tessera::agent
