// Queries of a game: what it asks becomes a BodyQuery, hits become values, and what is wrong is named.
#include "core/game/query_calls.h"

#include <gmock/gmock.h>

#include <cstring>
#include <functional>
#include <limits>
#include <memory>

#include "core/game/game_host.h"
#include "core/game/testing/fake_game_world.h"
#include "core/game/testing/named_fields.h"
#include "core/game/testing/scripted_game.h"

namespace tessera::game::query_calls {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

tessera_game_value RealOf(double real) {
  tessera_game_value value{};
  value.type = TESSERA_GAME_REAL;
  value.as.real = real;
  return value;
}

tessera_game_value TextOf(const char* text) {
  tessera_game_value value{};
  value.type = TESSERA_GAME_TEXT;
  value.count = static_cast<std::uint32_t>(std::strlen(text));
  value.as.text = text;
  return value;
}

tessera_game_value ListOfValues(const std::vector<tessera_game_value>& values) {
  tessera_game_value value{};
  value.type = TESSERA_GAME_LIST;
  value.count = static_cast<std::uint32_t>(values.size());
  value.as.list = values.data();
  return value;
}

tessera_game_value RotationOf(double x, double y, double z, double w) {
  tessera_game_value value{};
  value.type = TESSERA_GAME_ROTATION;
  value.as.rotation[0] = x, value.as.rotation[1] = y, value.as.rotation[2] = z, value.as.rotation[3] = w;
  return value;
}

tessera_game_value V(double x, double y, double z) { return ToInterface(GameValue(Vec3d{x, y, z})); }
tessera_game_value W(std::int64_t whole) { return ToInterface(GameValue(whole)); }
tessera_game_value F(bool flag) { return ToInterface(GameValue(flag)); }
tessera_game_value B(std::uint64_t id) { return ToInterface(GameValue(BodyId(id))); }

class QueryCallsTest : public ::testing::Test {
 protected:
  // Runs `ask` as a callback of body 1. Returns whether the callback was committed.
  bool InACallback(std::function<bool(GameCalls&)> ask) {
    ScriptedGame game;
    game.On(kOnBodyContact, "crate", [&](GameCalls& calls, ScriptedGame::Arguments) { return ask(calls); });
    if (!world.Find(BodyId(1))) world.Add(1, 1);
    if (!world.Find(BodyId(2))) world.Add(2, 0, false);
    const tessera_game_module module = game.module();
    auto host = GameHost::Load(module, {"game.lua", "fine"}, world.shared_scene());
    EXPECT_TRUE(host.ok()) << host.status();
    (*host)->Run(Tick(1), std::vector<GameEvent>{{kOnBodyContact, BodyId(1), BodyId(2)}}, world);
    statistics = (*host)->statistics();
    return statistics.calls == 1 && statistics.errors == 0;
  }
  std::string ErrorOf(std::uint32_t function, std::vector<tessera_game_value> arguments) {
    std::string error = "no error";
    InACallback([&](GameCalls& calls) {
      if (!calls.CallRaw(function, arguments)) error = calls.error();
      return true;
    });
    EXPECT_THAT(world.asked, IsEmpty()) << "asked all the same";
    return error;
  }

  FakeGameWorld world;
  GameStatistics statistics;
};

TEST_F(QueryCallsTest, BodiesAreChosenByKindAndProperty) {
  for (const std::uint64_t id : {1, 2, 3}) world.Add(id, id == 3 ? 2 : 1);
  for (const std::uint64_t id : {1, 2, 3, 99}) world.answer.hits.push_back({BodyId(id), 0, {}, {}});
  const auto met = [&](const NamedFields& options) {
    std::vector<std::uint64_t> ids;
    EXPECT_TRUE(InACallback([&](GameCalls& calls) {
      // Properties that the callback itself has set count.
      if (!calls.Call(kBodySet, {BodyId(1), std::string("health"), std::int64_t{5}})) return false;
      if (!calls.CallRaw(kWorldRayAll, std::vector{V(0, 0, 0), V(0, 0, 8), options.value()})) return false;
      for (std::uint32_t i = 0; i < calls.result().count; ++i) {
        ids.push_back(calls.result().as.list[i].as.fields[0].value.as.id);
      }
      return true;
    }));
    return ids;
  };
  EXPECT_THAT(met({{"kinds", TextOf("crate")}}), ElementsAre(1, 2));
  EXPECT_THAT(met({{"kinds", ListOfValues({TextOf("ball"), TextOf("crate")})}}), ElementsAre(1, 2, 3));
  EXPECT_THAT(met({{"property", TextOf("health")}, {"value", W(100)}}), ElementsAre(2, 3));
  EXPECT_THAT(met({{"kinds", TextOf("crate")}, {"property", TextOf("health")}, {"value", W(5)}}), ElementsAre(1));
  EXPECT_THAT(met({{"property", TextOf("target")}, {"value", tessera_game_value{}}}), ElementsAre(1, 2, 3));
}

TEST_F(QueryCallsTest, AChoiceThatCannotBeMadeIsNamed) {
  const auto error = [&](const NamedFields& options) {
    return ErrorOf(kWorldRay, {V(0, 0, 0), V(0, 0, 8), options.value()});
  };
  EXPECT_THAT(error({{"kinds", W(3)}}), HasSubstr("`options.kinds` must be a kind or a list of kinds"));
  EXPECT_THAT(error({{"kinds", TextOf("crates")}}), HasSubstr("names \"crates\", which no body of the scene has"));
  EXPECT_THAT(error({{"property", TextOf("health")}}), HasSubstr("`options.value` is missing"));
  EXPECT_THAT(error({{"value", W(1)}}), HasSubstr("`options.property` is missing"));
  EXPECT_THAT(error({{"property", TextOf("mana")}, {"value", W(1)}}), HasSubstr("\"mana\", which the scene does not"));
  EXPECT_THAT(error({{"property", TextOf("health")}, {"value", F(true)}}),
              HasSubstr("`options.value` is not of the type of \"health\""));
}

TEST_F(QueryCallsTest, ARayAsksForTheNearestBodyButTheOneThatAsks) {
  world.answer = {.hits = {{BodyId(7), 0.25, {1, 2, 3}, {0, 1, 0}}}, .work = 300};
  ASSERT_TRUE(InACallback([](GameCalls& calls) {
    if (!calls.CallRaw(kWorldRay, std::vector{V(0, 0, 0), V(0, 0, 8)})) return false;
    const tessera_game_value& hit = calls.result();
    EXPECT_EQ(hit.type, static_cast<std::uint32_t>(TESSERA_GAME_FIELDS));
    EXPECT_EQ(hit.count, 5u);
    const auto field = [&](std::size_t i) { return std::string(hit.as.fields[i].name, hit.as.fields[i].name_bytes); };
    EXPECT_EQ(field(0), "body");
    EXPECT_EQ(hit.as.fields[0].value.as.id, 7u);
    EXPECT_EQ(field(1), "distance");
    EXPECT_EQ(hit.as.fields[1].value.as.real, 2);
    EXPECT_EQ(field(2), "fraction");
    EXPECT_EQ(hit.as.fields[2].value.as.real, 0.25);
    EXPECT_EQ(field(3), "normal");
    EXPECT_EQ(hit.as.fields[3].value.as.vector[1], 1);
    EXPECT_EQ(field(4), "point");
    EXPECT_EQ(hit.as.fields[4].value.as.vector[2], 3);
    return true;
  }));
  ASSERT_THAT(world.asked, SizeIs(1));
  const BodyQuery& asked = world.asked[0];
  EXPECT_EQ(asked.to, (Vec3d{0, 0, 8}));
  EXPECT_EQ(asked.most_hits, 1u);
  EXPECT_THAT(asked.filter.ignored, ElementsAre(BodyId(1)));
  EXPECT_EQ(asked.filter.layers, ~0u);
  EXPECT_FALSE(asked.filter.triggers);
  EXPECT_TRUE(std::holds_alternative<PointProbe>(asked.shape));
  EXPECT_GE(statistics.instructions, 300u) << "the callback pays";
}

TEST_F(QueryCallsTest, WithoutAHitThereIsNothingAndAnEmptyList) {
  ASSERT_TRUE(InACallback([](GameCalls& calls) {
    if (!calls.CallRaw(kWorldRay, std::vector{V(0, 0, 0), V(0, 0, 8)})) return false;
    EXPECT_EQ(calls.result().type, static_cast<std::uint32_t>(TESSERA_GAME_NOTHING));
    if (!calls.CallRaw(kWorldRayAll, std::vector{V(0, 0, 0), V(0, 0, 8)})) return false;
    EXPECT_EQ(calls.result().type, static_cast<std::uint32_t>(TESSERA_GAME_LIST));
    EXPECT_EQ(calls.result().count, 0u);
    return true;
  }));
}

TEST_F(QueryCallsTest, OptionsBecomeTheFilter) {
  const std::vector<tessera_game_value> layers{TextOf("debris"), TextOf("default")}, bodies{B(5), B(6)};
  const NamedFields options{{"dynamic", F(false)},
                            {"ignore", ListOfValues(bodies)},
                            {"layers", ListOfValues(layers)},
                            {"limit", W(3)},
                            {"self", F(true)},
                            {"static", F(false)},
                            {"triggers", F(true)}};
  world.SetLayers({"default", "players", "debris"});
  ASSERT_TRUE(InACallback([&](GameCalls& calls) {
    return calls.CallRaw(kWorldRayAll, std::vector{V(0, 0, 0), V(0, 0, 8), options.value()});
  }));
  ASSERT_THAT(world.asked, SizeIs(1));
  const BodyQuery& asked = world.asked[0];
  EXPECT_EQ(asked.filter.layers, 0b101u);
  EXPECT_THAT(asked.filter.ignored, ElementsAre(BodyId(5), BodyId(6))) << "but not itself";
  EXPECT_FALSE(asked.filter.dynamic_bodies);
  EXPECT_FALSE(asked.filter.static_bodies);
  EXPECT_TRUE(asked.filter.triggers);
  EXPECT_EQ(asked.most_hits, 3u);
}

TEST_F(QueryCallsTest, ShapesAreToldApartByTheirFields) {
  world.answer.hits = {{BodyId(3), 0, {}, {}}, {BodyId(9), 0, {}, {}}};
  const NamedFields ball{{"radius", W(2)}}, capsule{{"half_height", RealOf(0.5)}, {"radius", RealOf(0.25)}};
  const NamedFields box{{"half_extents", V(1, 2, 3)}, {"rotation", RotationOf(0, 0, 0.6, 0.8)}};
  ASSERT_TRUE(InACallback([&](GameCalls& calls) {
    if (!calls.CallRaw(kWorldOverlap, std::vector{ball.value(), V(1, 0, 0)})) return false;
    EXPECT_EQ(calls.result().count, 2u);
    EXPECT_EQ(calls.result().as.list[1].as.id, 9u);
    return calls.CallRaw(kWorldSweep, std::vector{capsule.value(), V(0, 0, 0), V(0, 0, 8)}) &&
           calls.CallRaw(kWorldSweep, std::vector{box.value(), V(0, 0, 0), V(0, 0, 8)});
  }));
  ASSERT_THAT(world.asked, SizeIs(3));
  EXPECT_EQ(std::get<SphereShape>(world.asked[0].shape).radius_m, 2);
  EXPECT_EQ(world.asked[0].from, world.asked[0].to);
  EXPECT_EQ(world.asked[0].most_hits, 64u);
  EXPECT_EQ(std::get<CapsuleShape>(world.asked[1].shape).half_height_m, 0.5);
  EXPECT_EQ(std::get<CapsuleShape>(world.asked[1].shape).radius_m, 0.25);
  EXPECT_EQ(std::get<BoxShape>(world.asked[2].shape).half_extents_m, (Vec3d{1, 2, 3}));
  EXPECT_EQ(world.asked[2].orientation.z, 0.6);
}

TEST_F(QueryCallsTest, AWayMustHaveALengthAndAnEnd) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(ErrorOf(kWorldRay, {V(1, 2, 3), V(1, 2, 3)}), "ray: `to` is the same point as `from`");
  EXPECT_EQ(ErrorOf(kWorldRay, {V(0, 0, 0), V(0, 0, 10'001)}), "ray: `to` must be within 10000 m of `from`, got 10001");
  EXPECT_EQ(ErrorOf(kWorldRay, {V(0, nan, 0), V(0, 0, 1)}), "ray: `from` is not finite");
  EXPECT_EQ(ErrorOf(kWorldRay, {V(0, 1e300, 0), V(0, 0, 1)}), "ray: `from` is beyond 1e+08 m");
  EXPECT_EQ(ErrorOf(kWorldRay, {V(0, 0, 0), V(0, 0, 1e300)}), "ray: `to` is beyond 1e+08 m");
  EXPECT_EQ(ErrorOf(kWorldRay, {V(0, 0, 0)}), "ray: `to` is missing");
  const NamedFields ball{{"radius", W(2)}};
  EXPECT_EQ(ErrorOf(kWorldSweep, {ball.value(), V(0, 0, 0), V(0, 0, 0)}), "sweep: `to` is the same point as `from`");
  EXPECT_EQ(ErrorOf(kWorldOverlap, {ball.value(), V(0, 0, -1e300)}), "overlap: `at` is beyond 1e+08 m");
}

TEST_F(QueryCallsTest, OptionsThatAreWrongAreNamed) {
  const auto error = [&](std::uint32_t function, const char* name, tessera_game_value value) {
    const NamedFields options{{name, value}};
    return ErrorOf(function, {V(0, 0, 0), V(0, 0, 1), options.value()});
  };
  EXPECT_EQ(error(kWorldRay, "layer", TextOf("default")),
            "ray: `options.layer` is no option; there are: at_time, dynamic, ignore, kinds, layers, property, self, "
            "static, triggers, value");
  EXPECT_EQ(error(kWorldRay, "limit", W(2)),
            "ray: `options.limit` is no option; there are: at_time, dynamic, ignore, kinds, layers, property, self, "
            "static, triggers, value");
  EXPECT_EQ(error(kWorldRay, "layers", TextOf("debris")),
            "ray: `options.layers` names \"debris\", which the scene does not; its layers: default");
  EXPECT_EQ(error(kWorldRay, "layers", W(2)), "ray: `options.layers` must be a layer's name or a list of names");
  EXPECT_EQ(error(kWorldRay, "ignore", W(2)), "ray: `options.ignore` must be a body or a list of bodies");
  EXPECT_EQ(error(kWorldRay, "static", W(1)), "ray: `options.static` must be true or false");
  for (const std::int64_t limit : {0, 65, -1}) {
    EXPECT_EQ(error(kWorldRayAll, "limit", W(limit)), "ray_all: `options.limit` must be a whole number, 1 to 64");
  }
}

TEST_F(QueryCallsTest, ShapesThatAreWrongAreNamed) {
  const auto error = [&](const NamedFields& shape) { return ErrorOf(kWorldOverlap, {shape.value(), V(0, 0, 0)}); };
  EXPECT_THAT(error({}), HasSubstr("overlap: `shape` must have radius (a ball), "));
  EXPECT_THAT(error({{"half_height", W(1)}}), HasSubstr("overlap: `shape` must have radius"));
  EXPECT_THAT(error({{"half_extents", V(1, 1, 1)}, {"radius", W(1)}}), HasSubstr("overlap: `shape` must have radius"));
  EXPECT_THAT(error({{"radios", W(1)}}), HasSubstr("overlap: `shape.radios` must have radius"));
  EXPECT_EQ(error({{"radius", W(0)}}), "overlap: `shape.radius` must be 0.001 to 1000 m");
  EXPECT_EQ(error({{"radius", RealOf(std::numeric_limits<double>::quiet_NaN())}}),
            "overlap: `shape.radius` must be 0.001 to 1000 m");
  EXPECT_EQ(error({{"half_extents", V(1, -1, 1)}}), "overlap: `shape.half_extents` must be 0.001 to 1000 m");
  EXPECT_EQ(error({{"radius", TextOf("wide")}}), "overlap: `shape.radius` must be a number");
  EXPECT_EQ(error({{"radius", W(1)}, {"rotation", RotationOf(0, 0, 0, 2)}}), "overlap: `shape.rotation` is not unit");
}

TEST_F(QueryCallsTest, ACallbackThatCannotPayFailsEvenIfItGoesOn) {
  world.answer.complete = false;
  std::string error;
  EXPECT_FALSE(InACallback([&](GameCalls& calls) {
    EXPECT_FALSE(calls.CallRaw(kWorldRay, std::vector{V(0, 0, 0), V(0, 0, 8)}));
    error = calls.error();
    return true;
  }));
  EXPECT_EQ(error, "ray: meets more than the callback's instructions can pay for");
  EXPECT_EQ(statistics.errors, 1u);
  ASSERT_THAT(world.asked, SizeIs(1));
  EXPECT_EQ(world.asked[0].most_work, GameSettings().instructions_per_callback);
}

TEST_F(QueryCallsTest, AQueryLooksBackAsFarAsItMay) {
  const double rate = world.scene().tick_rate_hz, nan = std::numeric_limits<double>::quiet_NaN();
  const auto error = [&](tessera_game_value value) {
    const NamedFields options{{"at_time", value}};
    return ErrorOf(kWorldRay, {V(0, 0, 0), V(0, 0, 1), options.value()});
  };
  EXPECT_THAT(error(RealOf(1e6)), HasSubstr("ray: `options.at_time` must be from "));
  EXPECT_THAT(error(RealOf(-rate)), HasSubstr("ray: `options.at_time` must be from "));
  EXPECT_THAT(error(RealOf(nan)), HasSubstr("ray: `options.at_time` must be from "));
  EXPECT_EQ(error(TextOf("now")), "ray: `options.at_time` must be a number, a tick and a part of one");
  ASSERT_THAT(world.asked, SizeIs(0));
  const NamedFields options{{"at_time", RealOf(0.25)}};
  EXPECT_TRUE(InACallback([&](GameCalls& calls) {
    return calls.CallRaw(kWorldRay, std::vector{V(0, 0, 0), V(0, 0, 1), options.value()});
  }));
  ASSERT_THAT(world.asked, SizeIs(1));
  EXPECT_EQ(world.asked[0].at_tick, 0.25);
}

}  // namespace
}  // namespace tessera::game::query_calls
