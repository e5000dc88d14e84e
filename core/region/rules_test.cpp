#include "core/region/rules.h"

#include <gtest/gtest.h>

#include <functional>
#include <set>
#include <vector>

namespace tessera::region {
namespace {

TEST(RulesTest, AreTheSameOnlyIfEverySettingIs) {
  const std::vector<std::function<void(Settings&)>> changes = {
      [](Settings&) {},
      [](Settings& s) { s.aura_m = 2; },
      [](Settings& s) { ++s.lookahead_ticks; },
      [](Settings& s) { ++s.vouch_ticks; },
      [](Settings& s) { ++s.ghost_depth; },
      [](Settings& s) { ++s.whole_up_to; },
      [](Settings& s) { s.hysteresis_m = 0; },
      [](Settings& s) { ++s.max_grants_per_tick; },
      [](Settings& s) { s.shared_origin = true; },
  };
  std::set<std::uint64_t> rules;
  for (const auto& change : changes) {
    Settings settings;
    change(settings);
    EXPECT_EQ(RulesOf(settings), RulesOf(settings));
    EXPECT_NE(RulesOf(settings), 0U);
    rules.insert(RulesOf(settings));
  }
  EXPECT_EQ(rules.size(), changes.size());
}

}  // namespace
}  // namespace tessera::region
