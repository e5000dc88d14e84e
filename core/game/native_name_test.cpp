#include "core/game/native_name.h"

#include <gmock/gmock.h>

namespace tessera::game {
namespace {

using ::testing::HasSubstr;

const std::string kBuild(64, 'a');

TEST(NativeNameTest, ATextNamesAGameAndPerhapsItsBuild) {
  const auto any = ParseNativeGame("native:arena");
  ASSERT_TRUE(any.ok()) << any.status();
  EXPECT_EQ(any->name, "arena");
  EXPECT_EQ(any->hash, "");
  const auto one = ParseNativeGame("native:arena-2_b@" + kBuild);
  ASSERT_TRUE(one.ok()) << one.status();
  EXPECT_EQ(one->name, "arena-2_b");
  EXPECT_EQ(one->hash, kBuild);
}

TEST(NativeNameTest, AFileIsNoNativeGame) {
  EXPECT_TRUE(IsNativeGame("native:"));
  EXPECT_FALSE(IsNativeGame("arena.lua"));
  EXPECT_FALSE(IsNativeGame("./native:arena.lua"));
  EXPECT_FALSE(ParseNativeGame("arena").ok());
}

TEST(NativeNameTest, ANameThatCouldLeadOutOfTheFolderIsRefused) {
  for (const char* text : {"native:", "native:..", "native:../arena", "native:/arena", "native:a/b", "native:a.so",
                           "native:a b", "native:@"}) {
    EXPECT_THAT(std::string(ParseNativeGame(text).status().message()), HasSubstr("its name must be 1 to 63 letters"))
        << text;
  }
  EXPECT_FALSE(ParseNativeGame("native:" + std::string(64, 'a')).ok());
  EXPECT_TRUE(ParseNativeGame("native:" + std::string(63, 'a')).ok());
}

TEST(NativeNameTest, AHashThatIsNoneIsRefusedByTheGamesName) {
  for (const std::string& hash :
       {std::string(), std::string("aaaa"), std::string(63, 'a'), std::string(65, 'a'), std::string(64, 'A')}) {
    EXPECT_EQ(ParseNativeGame("native:arena@" + hash).status().message(),
              "game module arena: after '@' must come the 64 hexadecimal digits of its SHA-256");
  }
}

TEST(NativeNameTest, PeopleSeeTheBeginningOfTheHash) {
  EXPECT_EQ(NativeGameText("arena", kBuild), "native:arena@aaaaaaaa");
  EXPECT_EQ(NativeGameText("arena", ""), "native:arena");
}

TEST(NativeNameTest, ADeathIsKnownByItsLine) {
  EXPECT_EQ(DeathInModule("died in game module arena: Aborted in on_tick"), "arena: Aborted in on_tick");
  EXPECT_EQ(DeathInModule("game tick=1 text=\"died in game module arena: no\""), "");
  EXPECT_EQ(DeathInModule(""), "");
}

}  // namespace
}  // namespace tessera::game
