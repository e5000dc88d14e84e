#include "core/replication/command.h"

#include <gmock/gmock.h>

#include <string>

namespace tessera::replication {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::string WhyNot(const std::vector<std::uint8_t>& bytes) {
  return std::string(DecodeCommands(bytes).status().message());
}

TEST(CommandTest, AMessageComesOutAsItWentIn) {
  const std::string longest(kMaxCommandBytes, 'x');
  const std::vector<std::uint8_t> bytes = EncodeCommands({7, 300, {"jump", "", longest}});
  EXPECT_LE(bytes.size(), kMaxCommandDatagramBytes);
  const auto read = DecodeCommands(bytes);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->last_event, 7U);
  EXPECT_EQ(read->base, 300U);
  EXPECT_THAT(read->commands, ElementsAre("jump", "", longest));
}

TEST(CommandTest, ACommandSaysWhatWasShownAndMadeWhenItWasGiven) {
  const auto read = DecodeCommands(
      EncodeCommands({7, 300, {Command("shoot", 123'456'789), "jump", Command("throw", 1, 4'000'000'000)}}));
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->commands[0].shown_at, 123'456'789U);
  EXPECT_EQ(read->commands[1].shown_at, 0U);
  EXPECT_EQ(read->commands[1].with_input, 0U);
  EXPECT_EQ(read->commands[2].with_input, 4'000'000'000U);
}

TEST(CommandTest, AMessageMayHaveNoCommands) {
  const auto read = DecodeCommands(EncodeCommands({.last_event = 9}));
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->last_event, 9U);
}

TEST(CommandTest, AsManyAreSentAsFitADatagram) {
  const std::string big(kMaxCommandBytes, 'x'), small(30, 'y');
  const std::vector<Command> commands{big, small, small, small};
  EXPECT_EQ(CommandsThatFit(commands), 3U);
  const std::vector<Command> many(100, "z");
  EXPECT_EQ(CommandsThatFit(many), kMaxCommandsInDatagram);
  EXPECT_LE(EncodeCommands({~0U, 1000, {commands.begin(), commands.begin() + 3}}).size(), kMaxCommandDatagramBytes);
}

TEST(CommandTest, ALongerCommandIsRefusedByItsSize) {
  std::vector<std::uint8_t> bytes{3, 0, 1, 1, 0x80, 0x10};  // 2048
  bytes.resize(bytes.size() + 2048, 'x');
  EXPECT_EQ(WhyNot(bytes), "commands: 2048 bytes are more than 1024");
}

TEST(CommandTest, MalformedBytesAreRefusedByTheirField) {
  EXPECT_THAT(WhyNot({}), HasSubstr("kind"));
  EXPECT_THAT(WhyNot({2, 0, 0, 0}), HasSubstr("kind"));
  EXPECT_THAT(WhyNot({3}), HasSubstr("truncated"));
  EXPECT_THAT(WhyNot({3, 0, 1, 1, 5, 'a'}), HasSubstr("truncated"));
  EXPECT_THAT(WhyNot({3, 0, 1, 1, 1, 'a', 0}), HasSubstr("truncated"));
  EXPECT_THAT(WhyNot({3, 0, 1, 1, 1, 'a', 0, 0, 'b'}), HasSubstr("trailing"));
  EXPECT_THAT(WhyNot({3, 0, 0, 1, 1, 'a', 0, 0}), HasSubstr("number is out of range"));
  EXPECT_THAT(WhyNot({3, 0, 1, 33}), HasSubstr("33 are more than 32"));
  EXPECT_THAT(WhyNot({3, 0xff, 0xff, 0xff, 0xff, 0x7f, 1, 0}), HasSubstr("out of range"));
  EXPECT_THAT(WhyNot({3, 0, 0xff, 0xff, 0xff, 0xff, 0x0f, 1, 1, 'a', 0, 0}), HasSubstr("number is out of range"));
}

}  // namespace
}  // namespace tessera::replication
