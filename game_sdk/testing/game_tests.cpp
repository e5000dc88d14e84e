#include "game_sdk/testing/game_tests.h"

#include <algorithm>
#include <memory>
#include <span>
#include <utility>

#include "absl/strings/str_cat.h"
#include "game_sdk/testing/script_run.h"

namespace tessera::game {
namespace {

struct Condition {
  std::string name;
  LockstepOptions options;
};

std::vector<Condition> ConditionsOf(const GameTestOptions& options) {
  LockstepOptions several;
  several.regions = options.regions;
  several.seed = options.seed;
  LockstepOptions one = several, fresh = several, deaths = several;
  one.regions = 1;
  fresh.fresh_states = true;
  deaths.deaths = true;
  const std::string regions = options.regions == 1 ? "1 region" : absl::StrCat(options.regions, " regions");
  std::vector<Condition> conditions;
  if (options.regions > 1) conditions.push_back({"1 region", one});
  conditions.push_back({regions, several});
  conditions.push_back({regions + ", fresh states", fresh});
  conditions.push_back({regions + ", deaths", deaths});
  return conditions;
}

// The end of a run, for comparing it with another one.
struct Trace {
  std::vector<std::uint64_t> hashes, ticks;
  std::vector<std::pair<std::string, std::string>> properties;  // "body 3: score" and its value

  explicit Trace(const ScriptWorld& script) : hashes(script.hashes()), ticks(script.ticks()) {
    script.world().ForEachBody([&](const region::OwnedBody& body) {
      for (const auto& [name, value] : script.world().PropertiesOf(body.def->id)) {
        properties.emplace_back(absl::StrCat("body ", body.def->id.value(), ": ", name), PropertyText(value));
      }
    });
  }
};

// Why the runs differ; nothing if they do not.
std::string Difference(const GameFile& game, const Trace& kept, const Trace& fresh) {
  if (kept.hashes == fresh.hashes) return "";
  const auto [at, other] = std::ranges::mismatch(kept.hashes, fresh.hashes);
  std::string text = absl::StrCat(game.name, ": fresh Lua states change the game");
  if (at != kept.hashes.end()) {
    absl::StrAppend(&text, " from tick ", kept.ticks[static_cast<std::size_t>(at - kept.hashes.begin())], " on");
  }
  const auto [property, differs] = std::ranges::mismatch(kept.properties, fresh.properties);
  if (property != kept.properties.end() && differs != fresh.properties.end()) {
    absl::StrAppend(&text, "; at the end ", property->first, " is ", property->second, ", with fresh states ",
                    differs->second);
  }
  return text;
}

void AddFailure(std::string text, const std::string& condition, GameTestResult& result) {
  const auto same = std::ranges::find(result.failures, text, &GameTestFailure::text);
  if (same != result.failures.end()) {
    same->conditions.push_back(condition);
  } else {
    result.failures.push_back({std::move(text), {condition}});
  }
}

absl::Status RunOne(const GameUnderTest& tested, const GameFile& script, std::size_t index,
                    std::span<const Condition> conditions, GameTestResult& result) {
  std::unique_ptr<const Trace> kept;
  for (const Condition& condition : conditions) {
    auto world = LockstepWorld::Create(tested.module, tested.game, tested.scene, condition.options);
    if (!world.ok()) return world.status();
    ScriptWorld run(*std::move(world));
    std::string error = RunTest(script, index, run);
    if (&condition == conditions.data()) result.output = run.output();
    result.ticks += run.ticks().size();
    result.handovers += run.world().handovers();
    result.deaths += run.world().deaths();
    const bool failed = !error.empty();
    if (failed) AddFailure(std::move(error), condition.name, result);
    if (!condition.options.fresh_states) kept.reset();  // they are for another number of regions
    if (condition.options.deaths || failed) continue;
    if (!condition.options.fresh_states) {
      kept = std::make_unique<const Trace>(run);
    } else if (kept != nullptr) {
      std::string difference = Difference(tested.game, *kept, Trace(run));
      if (!difference.empty()) AddFailure(std::move(difference), condition.name, result);
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<std::size_t> RunGameTests(const GameUnderTest& tested, const GameFile& script,
                                         const GameTestOptions& options,
                                         absl::FunctionRef<void(const GameTestResult&)> done) {
  const absl::StatusOr<std::vector<std::string>> names = ListTests(script);
  if (!names.ok()) return names.status();
  if (names->empty()) return absl::InvalidArgumentError(absl::StrCat(script.name, ": calls `test` nowhere"));
  const std::vector<Condition> conditions = ConditionsOf(options);
  std::size_t failed = 0;
  for (std::size_t i = 0; i < names->size(); ++i) {
    GameTestResult result;
    result.name = (*names)[i];
    if (absl::Status status = RunOne(tested, script, i, conditions, result); !status.ok()) return status;
    failed += result.failures.empty() ? 0 : 1;
    done(result);
  }
  return failed;
}

}  // namespace tessera::game
