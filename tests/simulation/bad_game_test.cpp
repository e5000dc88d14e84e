// Games that mean no good, in a world of four regions: whatever a callback does, it costs a line with file, line and
// name, is counted, leaves nothing half done and keeps the tick, and the world goes on.
#include <gmock/gmock.h>

#include <algorithm>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "game_sdk/api/api.h"
#include "game_sdk/lua/lua_module.h"
#include "tests/simulation/instance.h"
#include "tests/simulation/talk_model.h"

namespace tessera::simulation {
namespace {

using ::testing::AllOf;
using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

constexpr double kBadHalf_m = 20;
constexpr std::uint16_t kCulprit = 1, kWitness = 2, kWall = 3, kBall = 4, kAsker = 5, kGate = 6, kPlayer = 7;
constexpr PlayerNumber kVisitor{1};

// In each of four regions a culprit and a witness, and a wall in the middle.
SceneBuilder Place() {
  SceneBuilder builder(kBadHalf_m);
  Scene& scene = builder.scene();
  scene.kinds = {"", "culprit", "witness", "wall", "ball", "asker", "gate", "player"};
  scene.properties = {{"ticks", std::int64_t{0}}, {"half", std::int64_t{0}}, {"note", std::string()}, {"heat", 0.0}};
  scene.instance_properties = {{"halves", std::int64_t{0}}};
  for (const double x : {-10.0, 10.0}) {
    for (const double z : {-10.0, 10.0}) {
      builder.Add(Ball(0.5), {x, 0, z}).kind = kCulprit;
      builder.Add(Ball(0.5), {x + 4, 0, z}).kind = kWitness;
    }
  }
  for (BodyDef& body : scene.bodies) body.may_sleep = false;
  BodyDef& wall = builder.Add(Box(1), {0, 0, 0});
  wall.name = "wall";
  wall.kind = kWall;
  wall.motion = Motion::kStatic;
  wall.mass_kg = 0;
  Prefab& prefab = scene.prefabs.emplace_back();
  prefab.name = "ball";
  BodyDef& ball = prefab.bodies.emplace_back();
  ball.id = BodyId(1);
  ball.kind = kBall;
  ball.shape = Ball(0.3);
  ball.mass_kg = 1;
  return builder;
}

class BadGame {
 public:
  explicit BadGame(const std::string& source, const SceneBuilder& place = Place()) {
    SimulationOptions options;
    options.game = [this, source](std::shared_ptr<const Scene> scene) -> std::shared_ptr<game::GameHost> {
      auto host = game::GameHost::Load(*game::LuaGameModule(), {"bad.lua", source}, std::move(scene), {}, 7);
      EXPECT_TRUE(host.ok()) << host.status();
      return hosts_.emplace_back(*std::move(host));
    };
    instance = std::make_unique<Instance>(place, 4, options);
    simulation().on_step = [this, before = simulation().on_step](SimulatedRegion& worker,
                                                                 const region::StepResult& result) {
      before(worker, result);
      const std::uint64_t now = Sum([](const game::GameHost& host) { return host.statistics().instructions; });
      most_instructions_ = std::max(most_instructions_, now - instructions_);
      instructions_ = now;
      for (const auto& host : hosts_) {
        for (game::GameLine& line : host->TakeLines()) (line.error ? errors : lines).push_back(std::move(line.text));
      }
    };
  }

  Simulation& simulation() { return *instance->simulation; }
  // All regions make these ticks, each within its work, and no body is lost.
  void RunTo(Tick tick) {
    simulation().RunTo(tick);
    simulation().Settle();
    EXPECT_THAT(simulation().problems(), IsEmpty());
    const game::GameSettings limits;
    EXPECT_LE(most_instructions_, limits.instructions_per_tick + limits.instructions_per_callback + 1);
  }
  std::uint64_t Sum(const std::function<std::uint64_t(const game::GameHost&)>& of) const {
    std::uint64_t sum = 0;
    for (const auto& host : hosts_) sum += of(*host);
    return sum;
  }
  std::uint64_t Errors() const {
    return Sum([](const game::GameHost& host) { return host.statistics().errors; });
  }
  game::CallbackCost CostOf(const std::string& callback) const {
    game::CallbackCost sum;
    for (const auto& host : hosts_) {
      const auto cost = host->costs().find(callback);
      if (cost == host->costs().end()) continue;
      sum.calls += cost->second.calls;
      sum.errors += cost->second.errors;
    }
    return sum;
  }
  // The property of all bodies of the kind.
  std::vector<std::int64_t> Values(std::uint16_t kind, const std::string& name) {
    std::vector<std::int64_t> values;
    for (const auto& [id, worker] : simulation().workers()) {
      for (const region::OwnedBody& body : worker->region().owned()) {
        if (body.def->kind == kind) values.push_back(ValueOf(worker->region(), body.def->id, name));
      }
    }
    return values;
  }
  std::int64_t OfWorld(const std::string& name) {
    for (const auto& [id, worker] : simulation().workers()) {
      if (worker->region().OwnsWorld()) return ValueOf(worker->region(), kInstanceBody, name);
    }
    ADD_FAILURE() << "nobody owns the world's record";
    return -1;
  }

  std::unique_ptr<Instance> instance;
  std::vector<std::string> errors, lines;

 private:
  static std::int64_t ValueOf(const region::Region& region, BodyId body, const std::string& name) {
    const Scene& scene = region.catalog().scene();
    const auto& declared = body == kInstanceBody ? scene.instance_properties : scene.properties;
    PropertySet changed;
    const region::KeptRecord* const record = region.records().Find(body);
    if (record != nullptr && !record->bytes->empty()) changed = *PropertySet::Decode(*record->bytes, declared);
    return std::get<std::int64_t>(*tessera::ValueOf(declared, {}, changed, name));
  }

  std::vector<std::shared_ptr<game::GameHost>> hosts_;
  std::uint64_t instructions_ = 0, most_instructions_ = 0;  // by all hosts, and by one region in one tick
};

// --- One bad statement after some good ones.

struct Badness {
  const char *name, *statement, *says;
};
class BadStatementTest : public testing::TestWithParam<Badness> {};

// Every third tick, so that no 20 failures come in a row: the callback stays on, and fails as long as the world runs.
// The bad statement stands in line 9.
constexpr char kHalfDone[] = R"(function on_message() world.halves = world.halves + 1 end
kinds.witness = { on_tick = function(self) self.ticks = self.ticks + 1 end }
kinds.culprit = {
  on_tick = function(self)
    if world.tick() % 3 ~= 0 then return end
    self.half = self.half + 1
    self:impulse(vec(0, 0, 1)) self:after(1, "half") world.send("half") world.count("half")
    world.spawn("ball", self:position() + vec(0, 3, 0), { expire_after = 100 })
)";

TEST_P(BadStatementTest, CostsALineAndACountAndNothingElse) {
  BadGame world(kHalfDone + std::string(GetParam().statement) + "\n  end,\n}\n");
  constexpr std::uint64_t kTicks = 120;
  world.RunTo(Tick(kTicks));
  const std::uint64_t ticks = world.simulation().tick().value();

  ASSERT_FALSE(world.errors.empty());
  EXPECT_THAT(world.errors, Each(AllOf(StartsWith("bad.lua:9: "), HasSubstr(GetParam().says))));
  EXPECT_EQ(world.errors.size(), 4 * (ticks / 3)) << "one each time, in each region";
  EXPECT_EQ(world.Errors(), world.errors.size());
  EXPECT_EQ(world.CostOf("kinds.culprit.on_tick").errors, world.errors.size());

  EXPECT_THAT(world.Values(kCulprit, "half"), Each(0));
  EXPECT_EQ(world.OfWorld("halves"), 0);
  EXPECT_EQ(world.simulation().invariants().made().made, 0U);
  EXPECT_EQ(world.Sum([](const game::GameHost& host) { return host.counters().size(); }), 0U);
  EXPECT_EQ(world.CostOf("kinds.culprit.on_timer").calls, 0U);
  for (const auto& [id, state] : world.simulation().States()) {
    EXPECT_EQ(state.linear_velocity, Vec3f()) << "body " << id.value();
  }
  EXPECT_THAT(world.Values(kWitness, "ticks"), AllOf(testing::SizeIs(4), Each(ticks))) << "all else goes on";
}

INSTANTIATE_TEST_SUITE_P(
    All, BadStatementTest,
    testing::Values(
        Badness{"EndlessLoop", "while true do end", "too much work"},
        Badness{"EndlessLoopThatCatchesItsEnd", "while true do pcall(function() while true do end end) end",
                "too much work"},
        Badness{"MemoryBomb", "local t = {} for i = 1, 1e7 do t[i] = string.rep('x', 60000) .. i end", "too much "},
        Badness{"DeepRecursion", "local function deep(n) return 1 + deep(n) end deep(1)", "nested too deeply"},
        Badness{"DeepRecursionThroughC", "local function deep() table.sort({ 2, 1 }, deep) end deep()",
                "C stack overflow"},
        Badness{"Error", "error('no')", "no"},
        Badness{"ErrorInTheErrorHandler", "error(setmetatable({}, { __tostring = function() error('inner') end }))",
                "an error that is a table"},
        Badness{"MillionSpawns", "for i = 1, 1e6 do world.spawn('ball', self:position() + vec(0, 3, 0)) end",
                "spawn: more bodies than a region may make in a tick"},
        Badness{"MillionSpawnsThatIgnoreTheRefusal",
                "for i = 1, 1e6 do pcall(world.spawn, 'ball', self:position() + vec(0, 3, 0)) end", "too much work"},
        Badness{"MillionMessages", "for i = 1, 1e6 do self:send('more') end", "send: "},
        Badness{"MillionTimers", "for i = 1, 1e6 do self:after(1000, 'more') end",
                "after: the body has 16 timers already"},
        Badness{"HugeText", "local s = 'x' while true do s = s .. s end", "a text of more than 64 KiB"},
        Badness{"HugeProperty", "self.note = string.rep('x', 64)", "note"},
        Badness{"HugeMessage", "world.send('half', { text = string.rep('x', 600) })", "send: "},
        Badness{"Pattern", "string.find(string.rep('a', 600), string.rep('a?', 100), 1, false)",
                "string.find: there are no patterns"},
        Badness{"FormatBomb", "for i = 1, 1e6 do string.format('%99.99f', 1e308) end", "too much work"},
        Badness{"GlobalWritten", "score = 1", "`score`"},
        Badness{"FunctionReplaced", "world.spawn = nil", "`world.spawn`"},
        Badness{"BinaryChunk", "load('\\27Lua')", "`load` is not defined"},
        Badness{"FileRead", "io.open('/etc/passwd')", "`io` is not defined"},
        Badness{"NotANumber", "self:set_velocity(vec(0 / 0, 0, 0))", "set_velocity: `velocity` must be finite"},
        Badness{"Infinity", "self:impulse(vec(0, 1 / 0, 0))", "impulse: `impulse` must be finite"},
        Badness{"NotANumberInAProperty", "self.heat = 0 / 0", "finite"},
        Badness{"FloatForAWholeNumber", "self:after(1.5, 'x')", "after: `ticks` must be a whole number"},
        Badness{"BodyThatIsGone",
                "local ball = world.spawn('ball', self:position() + vec(0, 4, 0)) ball:remove() ball:position()",
                "is not here"},
        Badness{"UnknownFunction", "self:impluse(vec(0, 1, 0))", "impluse"},
        Badness{"UnknownProperty", "self.colour = 1", "no property \"colour\""},
        Badness{"UnknownPropertyOfTheWorld", "print(world.colour)", "no property \"colour\""},
        Badness{"UnknownPrefab", "world.spawn('brik', vec(5, 0, 5))", "brik"},
        Badness{"UnknownMessageName", "self:send('')", "send: `name` must have 1 to 32 bytes"},
        Badness{"UnknownPlayer", "world.players()[1]:send('hello')", "nil value"},
        Badness{"SpawnOutsideTheWorld", "world.spawn('ball', vec(1e6, 0, 0))", "spawn: "},
        Badness{"SpawnInAWall", "world.spawn('ball', vec(0.5, 0, 0))",
                "spawn: \"ball\" would be inside static body 9 \"wall\""}),
    [](const auto& badness) { return std::string(badness.param.name); });

// --- A game in which every callback fails.

// Every callback in a line of its own, but for those that provoke the others.
constexpr char kFailing[] = R"(function on_timer() error("on_timer") end
function on_message() error("on_message") end
function on_answer() error("on_answer") end
function on_join() error("on_join") end
function on_leave() error("on_leave") end
function on_command() error("on_command") end
function on_control() error("on_control") end
kinds.culprit = {
  on_tick = function() error("on_tick") end,
  on_contact = function() error("on_contact") end,
  on_contact_ended = function() error("on_contact_ended") end,
  on_timer = function() error("on_timer") end,
  on_message = function() error("on_message") end,
  on_blast = function() error("on_blast") end,
}
kinds.gate = {
  on_entered = function() error("on_entered") end,
  on_left = function() error("on_left") end,
}
kinds.asker = {
  on_tick = function(self)
    self:set_velocity(vec(0, 0, 0))
    world.ask_overlap("who", { radius = 1 }, self:position())
  end,
  on_answer = function() error("on_answer") end,
}
kinds.witness = {
  on_tick = function(self)
    self.ticks = self.ticks + 1
    world.send("hello")
    if world.is_own() then world.after(1, "again") end
    if world.tick() % 4 == 0 then world.ask_overlap("who", { radius = 1 }, self:position()) end
    local culprit = world.overlap({ radius = 6 }, self:position(), { kinds = "culprit" })[1]
    if not culprit or world.tick() % 20 ~= 0 then return end
    culprit:send("hello") culprit:after(1, "again")
    world.explode({ at = culprit:position() + vec(0, 0, 1), radius = 2, impulse = 0.01 })
    world.spawn("ball", culprit:position() + vec(0, 0, 1.5), { velocity = vec(0, 0, -4), expire_after = 100 })
    if world.players()[1] then world.players()[1]:control(culprit) end
  end,
}
)";

TEST(FailingGameTest, EveryCallbackFailsAndIsSwitchedOffAndTheWorldGoesOn) {
  SceneBuilder place = Place();
  for (const double x : {-10.0, 10.0}) {
    place.Add(Ball(0.2), {x, 5, 5}).kind = kAsker;
    BodyDef& gate = place.Add(Ball(0.2), {x, 0, 11.2});
    gate.kind = kGate;
    gate.motion = Motion::kStatic;
    gate.mass_kg = 0;
    gate.trigger = true;
  }
  for (BodyDef& body : place.scene().bodies) {
    body.may_sleep = false;
    if (body.kind == kCulprit) body.mass_kg = 1000;  // it stays where it is
  }
  PlayerRules& rules = place.scene().player.emplace();
  rules.body.kind = kPlayer;
  rules.body.shape = Ball(0.5);
  rules.body.mass_kg = 80;
  rules.body.may_sleep = false;
  rules.spawn_points = {{-10, 5, 10}};
  rules.max_force_n = 10;
  rules.max_speed_m_s = 5;
  BadGame world(kFailing, place);
  world.simulation().SpawnPlayer(kVisitor, RegionId(1));
  TalkModel talk(world.simulation(), kVisitor, {});
  int given = 0;
  for (int frame = 0; frame < 900; ++frame) {
    if (frame % 10 == 0 && given < 30 && talk.Give("do")) ++given;
    talk.RunFor(16'667);
  }
  EXPECT_EQ(talk.pending(), 0U) << "a command is over though its callback fails";
  world.simulation().RemovePlayer(kVisitor);
  const Tick tick = world.simulation().tick() + 120;
  world.RunTo(tick);

  for (const char* name : {"on_timer", "on_message", "on_answer", "on_join", "on_leave", "on_command", "on_control",
                           "kinds.culprit.on_tick", "kinds.culprit.on_contact", "kinds.culprit.on_contact_ended",
                           "kinds.culprit.on_timer", "kinds.culprit.on_message", "kinds.culprit.on_blast",
                           "kinds.gate.on_entered", "kinds.gate.on_left", "kinds.asker.on_answer"}) {
    const game::CallbackCost cost = world.CostOf(name);
    EXPECT_GT(cost.calls, 0U) << name;
    EXPECT_EQ(cost.errors, cost.calls) << name;
    EXPECT_LE(cost.calls, 4 * game::GameSettings().failures_until_off) << name << " in each of four regions";
    const std::string short_name = std::string(name).substr(std::string(name).rfind('.') + 1);
    EXPECT_THAT(world.errors, testing::Contains(AllOf(StartsWith("bad.lua:"), HasSubstr(": " + short_name)))) << name;
  }
  EXPECT_THAT(world.errors, testing::Contains("kinds.culprit.on_tick failed 20 times in a row and is off"));
  const auto ticks = static_cast<std::int64_t>(world.simulation().tick().value());
  EXPECT_THAT(world.Values(kWitness, "ticks"), AllOf(testing::SizeIs(4), Each(ticks))) << "all else goes on";
  EXPECT_THAT(world.Values(kPlayer, "ticks"), IsEmpty()) << "the player is gone";
}

}  // namespace
}  // namespace tessera::simulation
