#include "core/region/rules.h"

#include <gtest/gtest.h>

#include <functional>
#include <set>
#include <vector>

namespace tessera::region {
namespace {

TEST(RulesTest, AreTheSameOnlyIfEverySettingIs) {
  const std::vector<std::function<void(RegionSettings&)>> changes = {
      [](RegionSettings&) {},
      [](RegionSettings& s) { s.aura_m = 2; },
      [](RegionSettings& s) { ++s.lookahead_ticks; },
      [](RegionSettings& s) { ++s.promise_ticks; },
      [](RegionSettings& s) { ++s.ghost_depth; },
      [](RegionSettings& s) { ++s.whole_up_to; },
      [](RegionSettings& s) { s.hysteresis_m = 0; },
      [](RegionSettings& s) { ++s.max_grants_per_tick; },
      [](RegionSettings& s) { s.shared_origin = true; },
  };
  std::set<std::uint64_t> rules;
  for (const auto& change : changes) {
    RegionSettings settings;
    change(settings);
    EXPECT_EQ(RulesOf(settings), RulesOf(settings));
    EXPECT_NE(RulesOf(settings), 0U);
    rules.insert(RulesOf(settings));
  }
  EXPECT_EQ(rules.size(), changes.size());
}

}  // namespace
}  // namespace tessera::region
