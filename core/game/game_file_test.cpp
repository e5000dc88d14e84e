#include "core/game/game_file.h"

#include <gmock/gmock.h>

namespace tessera::game {
namespace {

using ::testing::HasSubstr;

std::string Refusal(const GameFile& file) { return std::string(CheckGameFile(file).message()); }

TEST(GameFileTest, NameAndSizeAreBounded) {
  EXPECT_TRUE(CheckGameFile({"game.lua", "x = 1"}).ok());
  EXPECT_TRUE(CheckGameFile({std::string(kMaxGameNameBytes, 'g'), std::string(kMaxGameFileBytes, '\n')}).ok());
  EXPECT_THAT(Refusal({"", "x"}), HasSubstr("name: must be 1 to 64 bytes"));
  EXPECT_THAT(Refusal({std::string(kMaxGameNameBytes + 1, 'g'), "x"}), HasSubstr("name: "));
  EXPECT_THAT(Refusal({"game\n.lua", "x"}), HasSubstr("name: "));
  EXPECT_THAT(Refusal({std::string("game\0lua", 8), "x"}), HasSubstr("name: "));
  EXPECT_THAT(Refusal({"game\xFF.lua", "x"}), HasSubstr("name: "));
  EXPECT_EQ(Refusal({"game.lua", ""}), "content: is empty");
  EXPECT_EQ(Refusal({"game.lua", std::string(kMaxGameFileBytes + 1, ' ')}),
            "content: has 1048577 bytes, more than 1048576");
}

TEST(GameFileTest, TheSeedFollowsFromTheInstance) {
  EXPECT_EQ(GameSeed("inst-1"), GameSeed("inst-1"));
  EXPECT_NE(GameSeed("inst-1"), GameSeed("inst-2"));
  // The first 16 digits of SHA-256("abc"), FIPS 180-4's example.
  EXPECT_EQ(GameSeed("abc"), 0xba7816bf8f01cfeaULL);
}

TEST(GameFileTest, TheHashIsThatOfTheContentAlone) {
  EXPECT_EQ(GameHash("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

}  // namespace
}  // namespace tessera::game
