// The agent on a disk that is full, and with a file that cannot be read: the real program.
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>

#include "absl/strings/str_cat.h"
#include "agent/limits.h"
#include "agent/testing/agent_fixture.h"
#include "gmock/gmock.h"
#include "host/files.h"
#include "net/signing_key.h"
#include "telemetry/http_get.h"

namespace tessera::agent {
namespace {

using ::testing::ContainsRegex;
using ::testing::HasSubstr;

class AgentDiskTest : public AgentFixture {
 protected:
  std::string Metrics() const {
    const auto page =
        telemetry::HttpGet(absl::StrCat("127.0.0.1:", control_.record().hellos.back().metrics_port()), "/metrics");
    return page.ok() ? page->body : std::string(page.status().message());
  }
  static std::string Failing(const std::string& file, int value) {
    return absl::StrCat("\ntessera_agent_state_failing{file=\"", file, "\"} ", value, "\n");
  }
  static bool CanMount() {
    // NOLINTNEXTLINE(concurrency-mt-unsafe): no other thread asks for one
    return std::system("unshare --map-root-user --mount true 2>/dev/null") == 0;
  }
  // Its state folder is a disk of 4 MiB.
  std::unique_ptr<host::WatchedProgram> StartOnSmallDisk() {
    std::filesystem::create_directories(state_dir_);
    return StartAdmitted({"--stop-workers"}, {"/usr/bin/env", "unshare", "--map-root-user", "--mount", "sh", "-c",
                                              "mount -t tmpfs -o size=4m none \"$0\" && exec \"$@\"", state_dir_});
  }
  std::string PathOf(const host::WatchedProgram& agent, const std::string& file) const {
    return absl::StrCat("/proc/", agent.pid(), "/root", state_dir_, "/", file);
  }
  void Fill(const host::WatchedProgram& agent) {
    filler_ = PathOf(agent, "filler");
    std::ofstream file(filler_);
    while (file << std::string(4096, 'x') << std::flush) {
    }
  }
  void Empty() const { std::filesystem::remove(filler_); }
  // So many more come, so whatever goes before the last of them in the agent is done.
  bool AwaitHeartbeats(int more) {
    control_.Change([](ControlRecord& r) { r.heartbeats = 0; });
    return control_.WaitUntil([=](const ControlRecord& r) { return r.heartbeats >= more; });
  }

  static constexpr const char* kFiles[] = {"host.json", "workers.json", "orders", "revocations.json"};
  std::string filler_;
};

TEST_F(AgentDiskTest, AStateFolderThatIsFullIsToldUntilThereIsRoom) {
  if (!CanMount()) GTEST_SKIP() << "no disk can be mounted";
  const auto agent = StartOnSmallDisk();
  control_.SetDesired({Order(1)});
  ASSERT_TRUE(WaitForPhase(1, v1::WORKER_PHASE_RUNNING));
  HoldWorkers();
  for (const char* file : kFiles) EXPECT_THAT(Metrics(), HasSubstr(Failing(file, 0)));
  EXPECT_THAT(Metrics(), HasSubstr("\ntessera_agent_disk_size_bytes 4194304"));

  Fill(*agent);
  EXPECT_THAT(Metrics(), HasSubstr("\ntessera_agent_disk_available_bytes 0"));
  const auto change = [&](std::uint64_t revision) {
    control_.SetDesired({Order(1, revision)});
    return control_.WaitUntil([=](const ControlRecord& r) { return r.acted_on == revision; });
  };
  ASSERT_TRUE(change(2));
  // It is saved as the worker reports the order that it follows by now.
  EXPECT_TRUE(agent->WaitForText("/workers.json: ")) << agent->Output();
  EXPECT_THAT(Metrics(), HasSubstr(Failing("workers.json", 1)));
  EXPECT_THAT(Metrics(), HasSubstr(Failing("orders", 1)));
  EXPECT_THAT(Metrics(), HasSubstr(Failing("host.json", 0))) << "nothing of it has changed";
  EXPECT_THAT(agent->Output(), ContainsRegex(" error [^ ]*: cannot save: "));
  const auto follows = [](const ControlRecord& r) { return r.reports.at(1).order_revision() == 2U; };
  EXPECT_TRUE(control_.WaitUntil(follows)) << "the worker runs on";
  Empty();
  for (const char* file : {"workers.json", "orders"}) {
    EXPECT_TRUE(agent->WaitForText(absl::StrCat("saved again file=", file))) << "by itself";
    EXPECT_THAT(Metrics(), HasSubstr(Failing(file, 0)));
  }
}

// The control plane of a later release gives a host what it has to keep, when it has admitted it long ago.
TEST_F(AgentDiskTest, AnIdentityThatCannotBeWrittenIsToldAndWrittenOnceThereIsRoom) {
  if (!CanMount()) GTEST_SKIP() << "no disk can be mounted";
  const auto agent = StartOnSmallDisk();
  ASSERT_TRUE(AwaitHeartbeats(1)) << "it is admitted";
  Fill(*agent);
  control_.Stop();
  const net::SigningKey key = net::SigningKey::Make();
  control_.Change([&](ControlRecord& r) {
    r.revocations_key.assign(key.verification_key().begin(), key.verification_key().end());
  });
  control_.Start();
  ASSERT_TRUE(AwaitHeartbeats(1)) << agent->Output();
  EXPECT_THAT(Metrics(), HasSubstr(Failing("host.json", 1)));
  EXPECT_THAT(agent->Output(), ContainsRegex(" error [^ ]*: cannot save: [^ ]*/host.json: No space left on device"));
  Empty();
  EXPECT_TRUE(agent->WaitForText("saved again file=host.json")) << "by itself";
  EXPECT_THAT(Metrics(), HasSubstr(Failing("host.json", 0)));
  const auto kept = host::ReadFile(PathOf(*agent, "host.json"), kMaxStateFileBytes);
  ASSERT_TRUE(kept.ok()) << kept.status();
  EXPECT_THAT(*kept, HasSubstr("revocations_key"));
}

TEST_F(AgentDiskTest, AFileOfWorkersThatCannotBeReadIsToldUntilSomebodyHasLookedAtIt) {
  constexpr char kAside[] = "\ntessera_agent_workers_file_set_aside ";
  const auto first = StartAdmitted();
  ASSERT_TRUE(AwaitHeartbeats(2)) << "it is admitted";
  EXPECT_THAT(Metrics(), HasSubstr(absl::StrCat(kAside, "0\n")));
  first->Signal(SIGTERM);
  EXPECT_EQ(first->Wait(), Exited(0));
  std::ofstream(state_dir_ + "/workers.json") << "no JSON";
  const auto second = StartAgent();
  ASSERT_TRUE(AwaitHeartbeats(2));
  EXPECT_THAT(Metrics(), HasSubstr(absl::StrCat(kAside, "1\n")));
  EXPECT_THAT(second->Output(), ContainsRegex(" error [^ ]*: workers are looked for by their processes reason="));
  ASSERT_TRUE(std::filesystem::remove(state_dir_ + "/workers.json.unreadable"));
  ASSERT_TRUE(AwaitHeartbeats(2));
  EXPECT_THAT(Metrics(), HasSubstr(absl::StrCat(kAside, "0\n")));
}

}  // namespace
}  // namespace tessera::agent
