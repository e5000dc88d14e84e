// ./dev, with programs in the place of those that it calls which write down how they were called.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "host/files.h"
#include "host/temporary_folder.h"
#include "host/testing/watched_program.h"

namespace tessera::programs {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class DevTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::copy_file(TESSERA_SOURCE_DIR "/dev", Path("dev"));
    std::filesystem::create_directories(Path("build/release/bin"));
    std::filesystem::create_directory(Path("bin"));
    std::ofstream(Path("build/release/CMakeCache.txt")) << "TESSERA_SLOWNESS:STRING=1\n";
    std::ofstream(Path("build/release/build.ninja"));
  }
  std::string Path(const std::string& name) const { return folder_.path() + "/" + name; }
  // A program that writes its arguments to `calls`, and then does `more`.
  void Fake(const std::string& name, const std::string& more) {
    std::ofstream(Path(name)) << "#!/bin/bash\necho \"" << std::filesystem::path(name).filename().string()
                              << " $*\" >>'" << Path("calls") << "'\n"
                              << more << "\n";
    chmod(Path(name).c_str(), 0755);
  }
  std::string Calls() const { return host::ReadFile(Path("calls"), 100'000).value_or(""); }

  const host::TemporaryFolder folder_;
};

TEST_F(DevTest, PlayBuildsWhatItStartsAndTakesNoPortThatAnotherClusterHas) {
  Fake("bin/dpkg-query", "printf installed");
  Fake("bin/cmake", "");
  Fake("build/release/bin/tessera", R"(
case " $* " in
  *" up "*) echo '{"control":"unix:/fake.sock"}'; exec tail --pid=$PPID -f /dev/null ;;
esac)");
  Fake("build/release/bin/tessera-desktop", "");
  host::WatchedProgram play({"/usr/bin/env", "PATH=" + Path("bin") + ":/usr/bin:/bin", "DISPLAY=:none",
                             "TESSERA_SLOWNESS=1", "/bin/bash", Path("dev"), "play", "--scene", "plaza"});
  EXPECT_TRUE(play.Wait().Clean()) << play.Output();
  const std::string calls = Calls();
  // `tessera up` starts all of these.
  EXPECT_THAT(calls, HasSubstr("cmake --build build/release"));
  for (const char* program : {"tessera", "tessera-control", "tessera-agent", "tessera-region", "tessera-gateway"}) {
    EXPECT_THAT(calls, ::testing::ContainsRegex(std::string("--target.* bin/") + program + "( |\n)"));
  }
  EXPECT_THAT(calls,
              AllOf(HasSubstr(" up "), HasSubstr("--listen 127.0.0.1:0"), HasSubstr("--metrics-listen 127.0.0.1:0"),
                    HasSubstr("--page-listen 127.0.0.1:0"), HasSubstr("--socket ")));
  EXPECT_THAT(calls, HasSubstr("tessera-desktop --control unix:/fake.sock"));
}

}  // namespace
}  // namespace tessera::programs
