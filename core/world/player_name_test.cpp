#include "core/world/player_name.h"

#include <gmock/gmock.h>

#include <string>

#include "core/world/properties.h"

namespace tessera {
namespace {

using ::testing::HasSubstr;

std::string WhyNot(std::string_view name) { return std::string(CheckPlayerName(name).message()); }

TEST(PlayerNameTest, NamesInAnyScriptAreFine) {
  for (const char* name : {"", "ada", "Ада Лавлейс", "エイダ", "ada lovelace", "\xc2\xa0"}) {
    EXPECT_EQ(WhyNot(name), "") << name;
  }
  EXPECT_EQ(WhyNot(std::string(kMaxPlayerNameBytes, 'a')), "");
}

TEST(PlayerNameTest, WhatIsWrongIsNamed) {
  EXPECT_EQ(WhyNot(std::string(kMaxPlayerNameBytes + 1, 'a')), "player_name: 33 bytes are more than 32");
  for (const char* name : {"a\xff", "\xc3", "\xc0\xaf", "\xed\xa0\x80"}) {
    EXPECT_EQ(WhyNot(name), "player_name: is not UTF-8") << name;
  }
  for (const std::string& name : {std::string("a\nb"), std::string("\x1b[2J"), std::string("a\0b", 3),
                                  std::string("\x7f"), std::string("\xc2\x85")}) {
    EXPECT_EQ(WhyNot(name), "player_name: has a control character");
  }
}

const std::vector<PropertyDef> kNamedDefs{{"health", std::int64_t{100}}};

TEST(PlayerNameTest, GoesWithTheChangedPropertiesOfTheBody) {
  PropertySet set;
  set.set_player_name("ada");
  EXPECT_FALSE(set.empty());
  ASSERT_TRUE(set.Set(kNamedDefs, "health", std::int64_t{7}).ok());
  const auto read = PropertySet::Decode(set.Encode(), kNamedDefs);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(*read, set);
  EXPECT_EQ(read->player_name(), "ada");
  EXPECT_EQ(ValueOf(kNamedDefs, {}, *read, "health"), PropertyValue(std::int64_t{7}));
}

TEST(PlayerNameTest, BytesOfABadNameAreRefused) {
  const auto why_not = [](std::vector<std::uint8_t> bytes) {
    return std::string(PropertySet::Decode(bytes, kNamedDefs).status().message());
  };
  EXPECT_EQ(why_not({255, 1, 'a'}), "");
  EXPECT_THAT(why_not({255, 2, 'a'}), HasSubstr("truncated"));
  EXPECT_THAT(why_not({255, 1, '\n'}), HasSubstr("control character"));
  EXPECT_THAT(why_not({255, 0}), HasSubstr("empty"));
  EXPECT_THAT(why_not({255, 1, 'a', 255, 1, 'b'}), HasSubstr("out of order"));
  EXPECT_THAT(why_not({255, 1, 'a', 0, 2}), HasSubstr("out of order"));
  std::vector<std::uint8_t> longer(35, 'a');
  longer[0] = 255, longer[1] = 33;
  EXPECT_THAT(why_not(longer), HasSubstr("33 bytes are more than 32"));
}

}  // namespace
}  // namespace tessera
