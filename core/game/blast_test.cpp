#include "core/game/blast.h"

#include <gtest/gtest.h>

#include <limits>

#include "core/game/blast_calls.h"
#include "core/game/game_host.h"
#include "core/game/testing/fake_game_world.h"
#include "core/game/testing/scripted_game.h"

namespace tessera::game::blasts {
namespace {

Blast Sample() {
  Blast blast;
  blast.id = 7;
  blast.due = Tick(20);
  blast.ends = Tick(620);
  blast.by = BodyId(3);
  blast.at = {1, 2, 3};
  blast.radius_m = 4;
  blast.impulse_ns = 10;
  blast.name = "barrel";
  return blast;
}

TEST(BlastTest, ComesBackAsItWasWritten) {
  for (const std::optional<double> speed : {std::optional<double>(), std::optional(5.0)}) {
    Blast blast = Sample();
    blast.speed_m_s = speed;
    ByteWriter out;
    Write(out, blast);
    const std::vector<std::uint8_t> bytes = out.Take();
    EXPECT_GE(bytes.size(), kMinBlastBytes);
    ByteReader in(bytes);
    Blast back;
    ReadBlast(in, back);
    EXPECT_TRUE(in.ok());
    EXPECT_EQ(in.remaining(), 0U);
    EXPECT_EQ(back, blast);
  }
}

TEST(BlastTest, WhatCannotBeIsRefused) {
  EXPECT_TRUE(CheckBlast(Sample()).ok());
  const auto refused = [](auto change) {
    Blast blast = Sample();
    change(blast);
    return !CheckBlast(blast).ok();
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(refused([](Blast& blast) { blast.id = 0; }));
  EXPECT_TRUE(refused([](Blast& blast) { blast.ends = Tick(19); }));
  EXPECT_TRUE(refused([&](Blast& blast) { blast.at.y = nan; }));
  EXPECT_TRUE(refused([&](Blast& blast) { blast.radius_m = nan; }));
  EXPECT_TRUE(refused([](Blast& blast) { blast.radius_m = 0; }));
  EXPECT_TRUE(refused([&](Blast& blast) { blast.impulse_ns = nan; }));
  EXPECT_TRUE(refused([](Blast& blast) { blast.speed_m_s = -1; }));
  EXPECT_TRUE(refused([](Blast& blast) { blast.lift = 2; }));
  EXPECT_TRUE(refused([](Blast& blast) { blast.falloff = static_cast<BlastFalloff>(9); }));
}

TEST(BlastTest, FallsOffAsAskedFor) {
  Blast blast = Sample();
  const Vec3d half_way{3, 2, 3};
  EXPECT_DOUBLE_EQ(HitOf(blast, half_way, 100)->impulse_ns.x, 5);
  blast.falloff = BlastFalloff::kSquare;
  EXPECT_DOUBLE_EQ(HitOf(blast, half_way, 100)->impulse_ns.x, 2.5);
  blast.falloff = BlastFalloff::kNone;
  EXPECT_DOUBLE_EQ(HitOf(blast, half_way, 100)->impulse_ns.x, 10);
  EXPECT_FALSE(HitOf(blast, {5.01, 2, 3}, 100).has_value());
}

TEST(BlastTest, LightBodiesGetNoFasterThanItsSpeed) {
  Blast blast = Sample();
  blast.speed_m_s = 2;
  EXPECT_DOUBLE_EQ(HitOf(blast, {3, 2, 3}, 1)->impulse_ns.x, 1) << "2 m/s of 1 kg, and half of it is left here";
  EXPECT_DOUBLE_EQ(HitOf(blast, {3, 2, 3}, 100)->impulse_ns.x, 5);
}

TEST(BlastTest, LiftLeadsUpAndTheMiddleGoesStraightUp) {
  Blast blast = Sample();
  EXPECT_EQ(HitOf(blast, blast.at, 100)->impulse_ns, (Vec3d{0, 10, 0}));
  blast.lift = 1;
  const Vec3d impulse = HitOf(blast, {3, 2, 3}, 100)->impulse_ns;
  EXPECT_DOUBLE_EQ(impulse.x, impulse.y);
  EXPECT_NEAR(Length(impulse), 5, 1e-12);
}

class ExplodeTest : public ::testing::Test {
 protected:
  // Gives what explode said to these fields, which have to ascend; empty where it did it.
  std::string Explode(const std::vector<std::pair<std::string, GameValue>>& given) {
    std::string said;
    game_.On(kOnTick, "", [&](GameCalls& calls, ScriptedGame::Arguments) {
      std::vector<tessera_game_field> fields;
      fields.reserve(given.size());
      for (const auto& [name, value] : given) fields.push_back({name.data(), name.size(), ToInterface(value)});
      tessera_game_value table{};
      table.type = TESSERA_GAME_FIELDS;
      table.count = static_cast<std::uint32_t>(fields.size());
      table.as.fields = fields.data();
      if (!calls.CallRaw(kWorldExplode, {&table, 1})) said = calls.error();
      return true;
    });
    module_ = game_.module();
    auto host = GameHost::Load(module_, {"game.lua", "fine"}, world.shared_scene());
    EXPECT_TRUE(host.ok());
    (*host)->Run(Tick(9), {}, world);
    return said;
  }
  FakeGameWorld world;

 private:
  ScriptedGame game_;
  tessera_game_module module_{};
};

TEST_F(ExplodeTest, NamesTheTickAtWhichAllRegionsCanAct) {
  world.hops = 3;
  ASSERT_EQ(Explode({{"at", Vec3d{1, 2, 3}}, {"impulse", 5.0}, {"radius", std::int64_t{4}}}), "");
  ASSERT_EQ(world.blasts.size(), 1U);
  EXPECT_EQ(world.blasts[0].due, Tick(9 + 4 + 2 * 2));
  EXPECT_EQ(world.blasts[0].ends, Tick(17 + 600));
  EXPECT_EQ(world.blasts[0].radius_m, 4);
  EXPECT_TRUE(CheckBlast(world.blasts[0]).ok());
}

TEST_F(ExplodeTest, NamesWhatIsWrong) {
  const Vec3d at{1, 2, 3};
  EXPECT_EQ(Explode({{"impulse", 5.0}, {"radius", 4.0}}), "explode: `at` is missing");
  EXPECT_EQ(Explode({{"at", at}, {"impulse", 5.0}}), "explode: `radius` is missing");
  EXPECT_EQ(Explode({{"at", at}, {"impulse", 5.0}, {"radius", -1.0}}),
            "explode: `radius` must be 0.001 to 200, got -1");
  EXPECT_EQ(Explode({{"at", at}, {"impulse", std::numeric_limits<double>::quiet_NaN()}, {"radius", 1.0}}),
            "explode: `impulse` must be -1e+09 to 1e+09, got nan");
  EXPECT_EQ(Explode({{"at", Vec3d{1e6, 0, 0}}, {"impulse", 5.0}, {"radius", 4.0}}),
            "explode: `at` is outside the scene's bounds");
  EXPECT_EQ(Explode({{"at", at}, {"falloff", std::string("cubic")}, {"impulse", 5.0}, {"radius", 4.0}}),
            "explode: `falloff` is none of none, linear, square");
  EXPECT_EQ(Explode({{"at", at}, {"impulse", 5.0}, {"layers", std::string("sky")}, {"radius", 4.0}}),
            "explode: `layers` must be layers of the scene, which are: default");
  EXPECT_EQ(Explode({{"at", at}, {"impulse", 5.0}, {"radius", 4.0}, {"sound", std::string("bang")}}),
            "explode: `sound` is none of at, radius, impulse, speed, lift, falloff, layers, name");
  EXPECT_TRUE(world.blasts.empty());
}

TEST_F(ExplodeTest, ARegionKeepsNoMoreThanItMay) {
  world.blasts.resize(kMaxBlasts);
  EXPECT_EQ(Explode({{"at", Vec3d{1, 2, 3}}, {"impulse", 5.0}, {"radius", 4.0}}),
            "explode: the region keeps 256 of the last ten seconds already");
}

}  // namespace
}  // namespace tessera::game::blasts
