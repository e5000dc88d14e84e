// The agent on a disk that is full: the real program, and a disk of its own.
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>

#include "absl/strings/str_cat.h"
#include "agent/testing/agent_fixture.h"
#include "gmock/gmock.h"
#include "telemetry/http_get.h"

namespace tessera::agent {
namespace {

using ::testing::HasSubstr;

class AgentDiskTest : public AgentFixture {
 protected:
  std::string Metrics() const {
    const auto page =
        telemetry::HttpGet(absl::StrCat("127.0.0.1:", control_.record().hellos.at(0).metrics_port()), "/metrics");
    return page.ok() ? page->body : std::string(page.status().message());
  }
};

TEST_F(AgentDiskTest, AStateFolderThatIsFullIsToldUntilThereIsRoom) {
  // NOLINTNEXTLINE(concurrency-mt-unsafe): no other thread asks for one
  if (std::system("unshare --map-root-user --mount true 2>/dev/null") != 0) GTEST_SKIP() << "no disk can be mounted";
  std::filesystem::create_directories(state_dir_);
  const auto agent =
      StartAdmitted({"--stop-workers"}, {"/usr/bin/env", "unshare", "--map-root-user", "--mount", "sh", "-c",
                                         "mount -t tmpfs -o size=4m none \"$0\" && exec \"$@\"", state_dir_});
  control_.SetDesired({Order(1)});
  ASSERT_TRUE(WaitForPhase(1, v1::WORKER_PHASE_RUNNING));
  HoldWorkers();
  EXPECT_THAT(Metrics(), HasSubstr("\ntessera_agent_state_failing 0"));
  EXPECT_THAT(Metrics(), HasSubstr("\ntessera_agent_disk_size_bytes 4194304"));

  const std::string filler = absl::StrCat("/proc/", agent->pid(), "/root", state_dir_, "/filler");
  std::ofstream file(filler);
  while (file << std::string(4096, 'x') << std::flush) {
  }
  EXPECT_THAT(Metrics(), HasSubstr("\ntessera_agent_disk_available_bytes 0"));
  const auto change = [&](std::uint64_t revision) {
    control_.SetDesired({Order(1, revision)});
    return control_.WaitUntil([=](const ControlRecord& r) { return r.acted_on == revision; });
  };
  ASSERT_TRUE(change(2));
  EXPECT_THAT(Metrics(), HasSubstr("\ntessera_agent_state_failing 1"));
  EXPECT_THAT(agent->Output(), HasSubstr("cannot save: "));
  EXPECT_EQ(control_.record().reports.at(1).order_revision(), 2U) << "the worker runs on";
  file.close();
  std::filesystem::remove(filler);
  ASSERT_TRUE(change(3));
  EXPECT_THAT(Metrics(), HasSubstr("\ntessera_agent_state_failing 0"));
}

}  // namespace
}  // namespace tessera::agent
