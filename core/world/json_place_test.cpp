#include "core/world/json_place.h"

#include <gtest/gtest.h>

#include <string>

namespace tessera {
namespace {

// The text from the place on.
std::string From(std::string_view text, std::string_view path) {
  const std::optional<std::size_t> place = JsonPlace(text, path);
  return place ? std::string(text.substr(*place)) : "nowhere";
}

TEST(JsonPlaceTest, IsTheNameOfAMemberOrTheBeginningOfAnElement) {
  const std::string text = R"({"a": "}]{\"", "heightField": [1, [2, {"x": 5}], {"b" : [] , "c": {}}], "d": null})";
  EXPECT_EQ(From(text, "a"), text.substr(1));
  EXPECT_EQ(From(text, "d"), R"("d": null})");
  EXPECT_EQ(From(text, "height_field[2].c"), R"("c": {}}], "d": null})");
  EXPECT_EQ(From(text, "heightField[1][1].x"), R"("x": 5}], {"b" : [] , "c": {}}], "d": null})");
  EXPECT_EQ(From(text, "height_field[0]"), text.substr(text.find("1, [")));
}

TEST(JsonPlaceTest, IsNowhereForWhatIsNotThere) {
  const std::string text = R"({"a": {"b": 1}, "c": [1]})";
  for (const char* path : {"x", "a.x", "a[0]", "c[1]", "c.x", "a.b.c", "", "[", "[1", "[x]", ".", "a..b"}) {
    EXPECT_EQ(From(text, path), "nowhere") << path;
  }
}

TEST(JsonPlaceTest, TakesAnyTextThatEndsAnywhere) {
  const std::string text = R"({"a": [{"s": "\\\""}, {"b": 1}]})";
  for (std::size_t size = 0; size < text.size(); ++size) {
    const std::optional<std::size_t> place = JsonPlace(std::string_view(text).substr(0, size), "a[1].b");
    EXPECT_TRUE(!place || *place < size) << size;
  }
  EXPECT_EQ(From("{\"a\": " + std::string(1'000'000, '['), "b"), "nowhere");
}

}  // namespace
}  // namespace tessera
