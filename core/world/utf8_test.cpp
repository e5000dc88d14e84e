#include "core/world/utf8.h"

#include <gtest/gtest.h>

namespace tessera {
namespace {

TEST(Utf8Test, TextOfAnyLanguageStaysAsItIs) {
  for (const char* text :
       {"", "plain", "gr\xC3\xBC\xC3\x9F", "\xE6\x97\xA5\xE6\x9C\xAC", "\xF0\x9F\x8E\xB2", "\x7F", "\xC2\x80",
        "\xDF\xBF", "\xE0\xA0\x80", "\xED\x9F\xBF", "\xEF\xBF\xBF", "\xF0\x90\x80\x80", "\xF4\x8F\xBF\xBF"}) {
    EXPECT_TRUE(IsUtf8(text)) << text;
    EXPECT_EQ(ValidUtf8(text), text);
  }
}

// The forms that RFC 3629 forbids: continuations alone, too long forms, surrogates, above U+10FFFF, cut short.
TEST(Utf8Test, EachByteOfNoCharacterBecomesAQuestionMark) {
  const struct {
    const char *text, *valid;
  } cases[] = {
      {"\xFF", "?"},
      {"a\x80z", "a?z"},
      {"\xC0\xAF", "??"},
      {"\xC1\xBF", "??"},
      {"\xE0\x9F\xBF", "???"},
      {"\xED\xA0\x80", "???"},
      {"\xF0\x8F\xBF\xBF", "????"},
      {"\xF4\x90\x80\x80", "????"},
      {"\xF5\x80\x80\x80", "????"},
      {"caf\xC3", "caf?"},
      {"\xE6\x97", "??"},
      {"\xC3\xC3\xBC", "?\xC3\xBC"},
  };
  for (const auto& test : cases) {
    EXPECT_FALSE(IsUtf8(test.text)) << test.valid;
    EXPECT_EQ(ValidUtf8(test.text), test.valid);
  }
}

}  // namespace
}  // namespace tessera
