// `tessera game`: what the commands of docs/games.md do when something is wrong.
#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "host/files.h"
#include "host/temporary_folder.h"
#include "tests/support/run_program.h"

namespace tessera::programs {
namespace {

using support::RunProgram;
using support::RunResult;
using ::testing::HasSubstr;

class GameProgramTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const RunResult made = RunProgram("tessera", {"game", "new", game_});
    ASSERT_EQ(made.exit_code, 0) << made.err;
  }
  void Replace(const std::string& from, const std::string& to) const {
    std::string text = host::ReadFile(game_ + "/game.lua", 1 << 20).value();
    const std::size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    std::ofstream(game_ + "/game.lua") << text.replace(at, from.size(), to);
  }

  const host::TemporaryFolder folder_;
  const std::string game_ = folder_.path() + "/arena";
};

TEST_F(GameProgramTest, ANewGamePassesItsCheckAndItsTests) {
  const RunResult check = RunProgram("tessera", {"game", "check", game_});
  EXPECT_EQ(check.exit_code, 0) << check.out << check.err;
  const RunResult test = RunProgram("tessera", {"game", "test", game_, "--regions", "9", "--seed", "5"});
  EXPECT_EQ(test.exit_code, 0) << test.out << test.err;
  EXPECT_THAT(test.out, HasSubstr("3 tests passed"));
}

TEST_F(GameProgramTest, AFolderThatIsThereIsLeftAsItIs) {
  Replace("JUMP", "LEAP");
  const RunResult again = RunProgram("tessera", {"game", "new", game_});
  EXPECT_EQ(again.exit_code, 1);
  EXPECT_EQ(again.err, "tessera: " + game_ + ": is there already; choose another name\n");
  EXPECT_THAT(host::ReadFile(game_ + "/game.lua", 1 << 20).value(), HasSubstr("LEAP"));
  EXPECT_EQ(RunProgram("tessera", {"game", "new", folder_.path() + "/a b"}).exit_code, 1);
}

TEST_F(GameProgramTest, FaultsAndFailuresNameFileAndLine) {
  Replace("other.score = other.score + 1", "other.scroe = other.score + 2");
  const RunResult check = RunProgram("tessera", {"game", "check", game_ + "/game.lua"});
  EXPECT_EQ(check.exit_code, 1);
  EXPECT_EQ(check.out, game_ + "/game.lua:9: the scene declares no property `scroe`; did you mean `score`?\n");
  EXPECT_EQ(check.err, "tessera: " + game_ + "/game.lua: 1 fault\n");
  Replace("other.scroe", "other.score");
  const RunResult test = RunProgram("tessera", {"game", "test", game_});
  EXPECT_EQ(test.exit_code, 1);
  EXPECT_THAT(test.out, HasSubstr("FAIL  a ball that rolls through the gate scores once"));
  EXPECT_THAT(test.out, HasSubstr("game_test.lua:8: got 2, expected 1 (1 region; 4 regions; 4 regions, fresh states; "
                                  "4 regions, deaths)\n"));
  EXPECT_THAT(test.err, HasSubstr("2 of 3 tests failed"));
}

TEST_F(GameProgramTest, TheReferenceIsWrittenOnlyWhereItHasAPlace) {
  const std::string document = folder_.path() + "/games.md";
  std::ofstream(document) << "# Games\n";
  EXPECT_EQ(RunProgram("tessera", {"game", "reference", document}).exit_code, 1);
  EXPECT_EQ(host::ReadFile(document, 100).value(), "# Games\n");
  const std::string annotations = game_ + "/.tessera/tessera.lua";
  const std::string before = host::ReadFile(annotations, 1 << 20).value();
  std::ofstream(annotations) << "old";
  EXPECT_EQ(RunProgram("tessera", {"game", "reference", annotations}).exit_code, 0);
  EXPECT_EQ(host::ReadFile(annotations, 1 << 20).value(), before);
}

}  // namespace
}  // namespace tessera::programs
