#include "agent/release_programs.h"

#include <gmock/gmock.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "host/temporary_folder.h"

namespace tessera::agent {
namespace {

using ::testing::ElementsAre;
using ::testing::SizeIs;

class ReleaseProgramsTest : public ::testing::Test {
 protected:
  std::string Install(const std::string& release, mode_t mode = 0755) {
    std::filesystem::create_directories(folder_.path() + "/" + release);
    std::string program = folder_.path() + "/" + release + "/tessera-region";
    std::ofstream(program) << "#!/bin/sh\n";
    chmod(program.c_str(), mode);
    return program;
  }
  ReleasePrograms Programs(bool own_given = false) const {
    return ReleasePrograms({.own_release = "0.2.0",
                            .own_program = "/usr/bin/tessera-region",
                            .own_program_given = own_given,
                            .folder = folder_.path()});
  }

  const host::TemporaryFolder folder_;
};

TEST_F(ReleaseProgramsTest, WithoutAFolderThereIsTheOwnReleaseAlone) {
  const ReleasePrograms programs({.own_release = "0.2.0", .own_program = "/usr/bin/tessera-region", .folder = ""});
  EXPECT_THAT(programs.releases(), ElementsAre("0.2.0"));
  EXPECT_EQ(programs.ProgramOf("0.2.0"), "/usr/bin/tessera-region");
  EXPECT_EQ(programs.ProgramOf(""), "/usr/bin/tessera-region");
  EXPECT_EQ(programs.ProgramOf("0.1.0"), "");
}

TEST_F(ReleaseProgramsTest, AProgramOfEachReleaseIsFound) {
  const std::string older = Install("0.1.0"), tenth = Install("0.1.10"), ninth = Install("0.1.9");
  const ReleasePrograms programs = Programs();
  EXPECT_THAT(programs.releases(), ElementsAre("0.1.0", "0.1.9", "0.1.10", "0.2.0"));
  EXPECT_EQ(programs.ProgramOf("0.1.0"), older);
  EXPECT_EQ(programs.ProgramOf("0.1.9"), ninth);
  EXPECT_EQ(programs.ProgramOf("0.1.10"), tenth);
}

// While packages are installed the program beside the agent is the next release's already.
TEST_F(ReleaseProgramsTest, TheOwnProgramIsThatOfTheFolderUnlessOneIsGiven) {
  const std::string own = Install("0.2.0");
  EXPECT_EQ(Programs().ProgramOf("0.2.0"), own);
  EXPECT_EQ(Programs().ProgramOf(""), own);
  EXPECT_EQ(Programs(true).ProgramOf("0.2.0"), "/usr/bin/tessera-region");
}

TEST_F(ReleaseProgramsTest, WhatIsNoReleaseOrNoProgramIsPassedOver) {
  Install("0.1.0", 0644);
  Install("latest");
  Install("0.1");
  std::filesystem::create_directories(folder_.path() + "/0.0.9/tessera-region");
  std::ofstream(folder_.path() + "/0.0.8") << "a file";
  EXPECT_THAT(Programs().releases(), ElementsAre("0.2.0"));
}

TEST_F(ReleaseProgramsTest, OfManyTheNewestAndTheOwnOneAreNamed) {
  for (int i = 3; i < 30; ++i) Install("0." + std::to_string(i) + ".0");
  const std::vector<std::string> releases = Programs().releases();
  EXPECT_THAT(releases, SizeIs(16));
  EXPECT_EQ(releases.front(), "0.2.0");
  EXPECT_EQ(releases.back(), "0.29.0");
}

TEST(ReleaseNameTest, IsThreeNumbers) {
  for (const char* good : {"0.1.0", "10.20.30"}) EXPECT_TRUE(IsReleaseName(good)) << good;
  for (const char* bad : {"", "0.1", "0.1.0.0", "0.1.x", "../..", "0..1", "-1.0.0", "0.1.0/..", "99999999999.0.0"}) {
    EXPECT_FALSE(IsReleaseName(bad)) << bad;
  }
}

}  // namespace
}  // namespace tessera::agent
