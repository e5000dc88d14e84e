// ./dev, with programs in the place of those that it calls which write down how they were called.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>

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

// The check of `./dev lint`. Its marks are put together here, so that it does not find them in this file.
TEST_F(DevTest, CommentsThatNameNoSubjectAreFound) {
  const std::string slashes = std::string("/") + "/ ", opened = std::string("/") + "* ";
  std::ofstream(Path("bad.h")) << slashes << "What it is.\n"
                               << "int a;\n"
                               << "int b = 1;  " << slashes << "of a host\n"
                               << slashes << "The\n"
                               << slashes << "end. Who asks, knows.\n"
                               << slashes << "Of all, the first.\n"
                               << opened << "Whose it is. */\n"
                               << "int c; " << opened << "whom it is for */\n";
  std::ofstream(Path("bad.cmake")) << "set(a b)  # what is set\n";
  std::ofstream(Path("good.h")) << slashes << "The number\n"
                                << slashes << "of what is here: office, whole.\n"
                                << "const char* url = \"http:" << slashes << "of\";\n"
                                << opened << "The sum\n * of all. */\n"
                                << "int whose, of;\n";
  std::ofstream(Path("good.sh")) << "echo $# of \"# of\"\n";
  const std::string check = "cd '" + folder_.path() + "' && awk -f " TESSERA_SOURCE_DIR "/cmake/comment_openings.awk ";

  host::WatchedProgram all({"/bin/sh", "-c", check + "good.h bad.h good.sh bad.cmake"});
  EXPECT_EQ(all.Wait().code, 1);
  EXPECT_EQ(all.Output(),
            "bad.h:1: the comment opens with \"What\"\nbad.h:3: the comment opens with \"of\"\n"
            "bad.h:6: the comment opens with \"Of\"\nbad.h:7: the comment opens with \"Whose\"\n"
            "bad.h:8: the comment opens with \"whom\"\nbad.cmake:1: the comment opens with \"what\"\n");
  host::WatchedProgram good({"/bin/sh", "-c", check + "good.h good.sh"});
  EXPECT_TRUE(good.Wait().Clean()) << good.Output();
}

// The check of `./dev lint`, too.
TEST_F(DevTest, WideProseAndALongOverviewAreFound) {
  const std::string wide(121, 'x'), fits(120, 'x');
  std::ofstream(Path("wide.md")) << "# A page\n" << wide << "\n```sh\n" << wide << "\n```\n" << wide << "\n";
  std::ofstream(Path("fits.md")) << fits << "\n| " << wide << " |\n```\n" << wide << "\n```\n";
  std::ofstream overview(Path("architecture.md"));
  for (int i = 0; i < 201; ++i) overview << "a line\n";
  overview.close();
  const std::string check = "cd '" + folder_.path() + "' && awk -f " TESSERA_SOURCE_DIR "/cmake/wide_documents.awk ";

  host::WatchedProgram all({"/bin/sh", "-c", check + "fits.md wide.md architecture.md"});
  EXPECT_EQ(all.Wait().code, 1);
  EXPECT_EQ(all.Output(),
            "wide.md:2: 121 columns; 120 fit\nwide.md:6: 121 columns; 120 fit\n"
            "architecture.md:201: more than 200 lines\n");
  host::WatchedProgram good({"/bin/sh", "-c", check + "fits.md"});
  EXPECT_TRUE(good.Wait().Clean()) << good.Output();
}

// The check of `./dev lint`, too.
TEST_F(DevTest, IncludesOfARoomAboveAreFound) {
  for (const char* folder : {"net", "client_sdk/testing", "core/world"})
    std::filesystem::create_directories(Path(folder));
  std::ofstream(Path("net/a.h")) << "#include <map>\n#include \"core/world/ids.h\"\n#include \"net/b.h\"\n"
                                 << "#include \"core/region/region.h\"\n#include \"net/testing/flood.h\"\n";
  std::ofstream(Path("core/world/b.cpp")) << "#include \"core/physics/world.h\"\n#include \"absl/status/status.h\"\n";
  std::ofstream(Path("client_sdk/c.cpp")) << "#include \"net/a.h\"\n#include \"control_plane/join_page.h\"\n";
  std::ofstream(Path("client_sdk/c_test.cpp")) << "#include \"control_plane/join_page.h\"\n";
  std::ofstream(Path("client_sdk/testing/d.h")) << "#include \"control_plane/join_page.h\"\n";
  const std::string check = "cd '" + folder_.path() + "' && awk -f " TESSERA_SOURCE_DIR "/cmake/room_arrows.awk ";

  host::WatchedProgram all({"/bin/sh", "-c", check + "net/a.h ./core/world/b.cpp client_sdk/c.cpp"});
  EXPECT_EQ(all.Wait().code, 1);
  EXPECT_EQ(all.Output(),
            "net/a.h:4: net may not include core/region/region.h\nnet/a.h:5: net may not include net/testing/flood.h\n"
            "./core/world/b.cpp:1: core/world may not include core/physics/world.h\n"
            "client_sdk/c.cpp:2: client_sdk may not include control_plane/join_page.h\n");
  host::WatchedProgram tests({"/bin/sh", "-c", check + "client_sdk/c_test.cpp client_sdk/testing/d.h"});
  EXPECT_TRUE(tests.Wait().Clean()) << tests.Output();
}

TEST_F(DevTest, SkewTriesTheProgramsOfTheReleaseThatTheChangelogNames) {
  std::filesystem::create_directories(Path("build/dev"));
  std::ofstream(Path("build/dev/CMakeCache.txt")) << "TESSERA_SLOWNESS:STRING=1\n";
  std::ofstream(Path("build/dev/build.ninja"));
  std::ofstream(Path("CHANGELOG.md"))
      << "## [Unreleased]\n\nCommit 99: none yet\n\n## [0.7.0] - 2031-01-01\n\nCommit abc7: "
         "it\n\n## [0.6.0] - 2030-01-01\n\nCommit abc6: it\n";
  Fake("bin/dpkg-query", "printf installed");
  Fake("bin/cmake", "");
  Fake("bin/ctest", "echo \"with $TESSERA_OTHER_RELEASE\" >>'" + Path("calls") + "'");
  Fake("old-dev", "");
  Fake("bin/git", R"(
case "$*" in
  "worktree add "*) mkdir -p "$5"; cp old-dev "$5/dev" ;;
  *rev-parse*) echo abc7 ;;
esac)");
  host::WatchedProgram skew({"/usr/bin/env", "PATH=" + Path("bin") + ":/usr/bin:/bin", "TESSERA_SLOWNESS=1",
                             "/bin/bash", Path("dev"), "skew", "--repeat", "until-fail:2"});
  EXPECT_TRUE(skew.Wait().Clean()) << skew.Output();
  const std::string calls = Calls();
  EXPECT_THAT(calls, HasSubstr("git worktree add --quiet --detach build/skew/0.7.0 abc7\n"));
  EXPECT_THAT(calls, HasSubstr("old-dev build release bin/tessera bin/tessera-control bin/tessera-agent"));
  EXPECT_THAT(calls, HasSubstr("-R ^end_to_end_skew_test$ --repeat until-fail:2\n"));
  EXPECT_THAT(calls, HasSubstr("with " + Path("build/skew/0.7.0/build/release/bin") + "\n"));
}

TEST_F(DevTest, ALastingSuiteFailsWherePackagesDoNotPassAndKeepsTheirTimeWhereTheyDo) {
  std::ofstream(Path("CHANGELOG.md")) << "## [0.7.0] - 2031-01-01\n\nCommit abc7: it\n";
  std::filesystem::create_directories(Path("build/skew/0.7.0"));
  std::filesystem::create_directories(Path("cmake"));
  Fake("build/skew/0.7.0/dev", "");
  Fake("bin/cmake", "");
  Fake("bin/dpkg-query", "printf installed");
  Fake("bin/sudo", "exec \"$@\"");
  Fake("bin/git", "case \"$*\" in *rev-parse*) echo abc7 ;; *) echo 1 ;; esac");
  Fake("bin/cpack", "while [[ $1 != -B ]]; do shift; done; echo made >\"$2/one.deb\"");
  Fake("build/release/bin/tessera-bench", "echo \"with $TESSERA_OTHER_RELEASE\" >>'" + Path("calls") + "'");
  const auto run = [&] {
    host::WatchedProgram bench({"/usr/bin/env", "PATH=" + Path("bin") + ":/usr/bin:/bin", "TESSERA_SLOWNESS=1",
                                "/bin/bash", Path("dev"), "bench", "lasting", "--csv", "figures.csv"});
    const int code = bench.Wait().code;
    return std::pair(code, bench.Output());
  };
  Fake("cmake/fresh.sh", "echo no system; exit 3");
  const auto failed = run();
  EXPECT_NE(failed.first, 0);
  EXPECT_THAT(failed.second, HasSubstr("the packages do not pass"));
  EXPECT_THAT(Calls(), HasSubstr("tessera-bench lasting --csv figures.csv\nwith " +
                                 Path("build/skew/0.7.0/build/release/bin") + "\n"));
  Fake("cmake/fresh.sh", "echo \"install_to_world_s 41.5\"; [[ $TESSERA_FRESH_BRING == build/packages ]]");
  const auto passed = run();
  EXPECT_EQ(passed.first, 0) << passed.second;
  EXPECT_EQ(host::ReadFile(Path("figures.csv"), 1000).value_or(""),
            "suite,scene,engine,config,metric,value,unit\n"
            "lasting,install,tessera,fresh,install_to_world_s,41.5,s\n");
}

TEST_F(DevTest, SkewWithoutAReleaseSaysWhatIsMissing) {
  std::ofstream(Path("CHANGELOG.md")) << "## [Unreleased]\n";
  host::WatchedProgram skew({"/bin/bash", Path("dev"), "skew"});
  EXPECT_EQ(skew.Wait().code, 1);
  EXPECT_THAT(skew.Output(), HasSubstr("CHANGELOG.md names no release with its commit"));
}

}  // namespace
}  // namespace tessera::programs
