#include "agent/game_modules.h"

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>

#include "host/temporary_folder.h"

namespace tessera::agent {
namespace {

using ::testing::IsEmpty;

const std::string kBuildA(64, 'a'), kBuildB(64, 'b');

std::string GoodModule(const std::string& name, const std::string& hash) {
  return "game module " + name + " abi 1 hash " + hash + "\n";
}

// A folder of modules, which the tests' worker describes as they say themselves.
class GameModulesTest : public ::testing::Test {
 protected:
  GameModulesTest() { std::filesystem::create_directory(folder()); }
  std::string folder() const { return temporary_.path() + "/games"; }
  void Write(const std::string& file, const std::string& text) { std::ofstream(folder() + "/" + file) << text; }
  const v1::GameModule& module(int index) const { return modules_.list().modules(index); }

  host::TemporaryFolder temporary_;
  GameModules modules_{{.folder = temporary_.path() + "/games",
                        .region_binary = TESSERA_BINARY_DIR "/tests/agent_fake_worker",
                        .scratch = temporary_.path() + "/scratch"}};
};

TEST_F(GameModulesTest, AreListedByNameWithBuildAndInterface) {
  EXPECT_FALSE(modules_.Scan()) << "there are none, as before";
  Write("plaza.so", GoodModule("plaza", kBuildB));
  Write("arena.so", GoodModule("arena", kBuildA));
  Write("readme.txt", "not a game");
  EXPECT_TRUE(modules_.Scan());
  ASSERT_EQ(modules_.list().modules_size(), 2);
  EXPECT_EQ(module(0).name(), "arena");
  EXPECT_EQ(module(0).hash(), kBuildA);
  EXPECT_EQ(module(0).abi(), 1U);
  EXPECT_EQ(module(0).failure(), "");
  EXPECT_EQ(module(1).name(), "plaza");
  EXPECT_FALSE(modules_.Scan()) << "nothing has changed";
}

TEST_F(GameModulesTest, EachIsListedWithWhatItHas) {
  const auto with = [](const std::string& name, const std::string& what) {
    std::string line = GoodModule(name, kBuildA);
    line.insert(line.size() - 1, " with " + what);
    return line;
  };
  Write("both.so", with("both", "both"));
  Write("car.so", with("car", "movement"));
  Write("game.so", with("game", "game"));
  Write("old.so", GoodModule("old", kBuildA));
  ASSERT_TRUE(modules_.Scan());
  ASSERT_EQ(modules_.list().modules_size(), 4);
  EXPECT_TRUE(module(0).movement() && !module(0).no_game());
  EXPECT_TRUE(module(1).movement() && module(1).no_game());
  EXPECT_TRUE(!module(2).movement() && !module(2).no_game());
  EXPECT_TRUE(!module(3).movement() && !module(3).no_game()) << "of an earlier worker's program";
}

TEST_F(GameModulesTest, AFileThatIsReplacedIsDescribedAgainAndOneThatIsGoneIsLeftOut) {
  Write("arena.so", GoodModule("arena", kBuildA));
  ASSERT_TRUE(modules_.Scan());
  Write("new", GoodModule("arena", kBuildB));
  std::filesystem::rename(folder() + "/new", folder() + "/arena.so");
  EXPECT_TRUE(modules_.Scan());
  EXPECT_EQ(module(0).hash(), kBuildB);
  std::filesystem::remove(folder() + "/arena.so");
  EXPECT_TRUE(modules_.Scan());
  EXPECT_THAT(modules_.list().modules(), IsEmpty());
}

TEST_F(GameModulesTest, OneThatCannotRunIsListedWithTheReason) {
  Write("other.so", "tessera-region: game module other: is made for version 8 of the interface\n");
  Write("crashes.so", "crash\ndied in game module crashes: Segmentation fault while it was loaded\n");
  Write("silent.so", "");
  ASSERT_TRUE(modules_.Scan());
  ASSERT_EQ(modules_.list().modules_size(), 3);
  EXPECT_EQ(module(0).failure(), "died in game module crashes: Segmentation fault while it was loaded");
  EXPECT_EQ(module(1).failure(), "is made for version 8 of the interface");
  EXPECT_EQ(module(2).failure(), "exited with code 1");
  for (const v1::GameModule& module : modules_.list().modules()) EXPECT_EQ(module.hash(), "") << module.name();
}

TEST_F(GameModulesTest, NamesThatNoModuleHasArePassedOver) {
  Write("a b.so", GoodModule("a", kBuildA));
  Write(".so", GoodModule("x", kBuildA));
  Write("fine.so", GoodModule("fine", kBuildA));
  ASSERT_TRUE(modules_.Scan());
  ASSERT_EQ(modules_.list().modules_size(), 1);
  EXPECT_EQ(module(0).name(), "fine");
}

TEST_F(GameModulesTest, AHostOffersNoMoreThanItsLimit) {
  for (int i = 100; i < 170; ++i) {
    Write("game" + std::to_string(i) + ".so", GoodModule("game" + std::to_string(i), kBuildA));
  }
  ASSERT_TRUE(modules_.Scan());
  EXPECT_EQ(modules_.list().modules_size(), 64);
  EXPECT_EQ(module(63).name(), "game163");
}

TEST(GameModuleDescriptionTest, ALineOfAnotherModuleOrWithoutAHashIsNoDescription) {
  for (const std::string& line : {GoodModule("other", kBuildA), GoodModule("arena", "feed"), std::string("hello")}) {
    const v1::GameModule module = ReadDescription("arena", {line}, "exited with code 0", true);
    EXPECT_EQ(module.hash(), "") << line;
    EXPECT_NE(module.failure(), "") << line;
  }
  EXPECT_THAT(ReadDescription("arena", {GoodModule("arena", kBuildA)}, "killed by SIGKILL", false).hash(), IsEmpty());
  EXPECT_THAT(ReadDescription("arena", {std::string(900, 'x')}, "exited with code 1", false).failure().size(), 200U);
}

}  // namespace
}  // namespace tessera::agent
