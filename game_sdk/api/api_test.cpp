#include "game_sdk/api/api.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>

namespace tessera::game {
namespace {

TEST(GameApiTest, NumbersAscendAndNamesAreThoseOfOne) {
  const auto check = [](auto entries) {
    EXPECT_TRUE(std::ranges::is_sorted(entries, std::less_equal<>(), [](const auto& entry) { return entry.number; }));
    std::set<std::pair<Receiver, std::string_view>> names;
    for (const auto& entry : entries) {
      EXPECT_TRUE(names.emplace(entry.receiver, entry.name).second) << entry.name;
      EXPECT_FALSE(entry.doc.empty()) << entry.name;
      EXPECT_EQ(entry.doc.back(), '.') << entry.name;
    }
  };
  check(Functions());
  check(Callbacks());
}

TEST(GameApiTest, OptionalParametersComeLast) {
  for (const Function& function : Functions()) {
    const auto optional = std::ranges::find_if(function.parameters, &Parameter::optional);
    EXPECT_TRUE(std::all_of(optional, function.parameters.end(), [](const Parameter& p) { return p.optional; }))
        << function.name;
    for (const Parameter& parameter : function.parameters) EXPECT_NE(parameter.types, 0U) << function.name;
  }
}

TEST(GameApiTest, AreFoundByNameAndNumber) {
  EXPECT_EQ(FindFunction(Receiver::kBody, "impulse")->number, kBodyImpulse);
  EXPECT_EQ(FindFunction(Receiver::kWorld, "impulse"), nullptr);
  EXPECT_EQ(FindFunction(kWorldRandom)->name, "random");
  EXPECT_EQ(FindFunction(9999), nullptr);
  EXPECT_EQ(FindCallback(Receiver::kBody, "on_tick")->number, kOnBodyTick);
  EXPECT_EQ(FindCallback(Receiver::kWorld, "on_tick")->number, kOnTick);
  EXPECT_EQ(FindCallback(9999), nullptr);
}

}  // namespace
}  // namespace tessera::game
