// A game moves bodies in one region and over borders: neighbours step the same, and nothing is done twice.
#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <map>

#include "core/game/game_host.h"
#include "core/game/testing/scripted_game.h"
#include "core/region/log.h"
#include "core/region/region.h"
#include "core/region/region_state.h"
#include "core/region/testing/small_world.h"
#include "game_sdk/api/api.h"

namespace tessera::region {
namespace {

using game::GameCalls;
using game::GameHost;
using game::GameValue;
using game::ScriptedGame;
using Arguments = ScriptedGame::Arguments;

constexpr BodyId kMoved{1};

// Regions side by side, from x = -10 to 10, in lockstep, with a game that acts on body 1 in its tick.
using Act = std::function<bool(GameCalls&, std::int64_t tick)>;

class RegionMotionTest : public ::testing::Test {
 protected:
  void Begin(Scene scene, std::uint32_t regions, Act act = {}) {
    scene.kinds = {"", "ball"};
    scene.bodies[0].kind = 1;
    scene_ = std::make_shared<const Scene>(std::move(scene));
    regions_.clear();
    if (act) {
      game.On(game::kOnBodyTick, "ball", [act](GameCalls& calls, Arguments) {
        EXPECT_TRUE(calls.Call(game::kWorldTick, {}));
        return act(calls, calls.result().as.whole);
      });
    }
    module_ = game.module();
    const PartitionMap map = *MakeGridMap(scene_->ground(), regions);
    for (const MapRegion& entry : map.regions()) {
      auto host = GameHost::Load(module_, {"game.lua", "fine"}, scene_);
      ASSERT_TRUE(host.ok()) << host.status();
      Config config{entry.id, Incarnation(1), scene_, map, {}, nullptr};
      config.game = *std::move(host);
      regions_[entry.id] = std::make_unique<Region>(std::move(config));
    }
    std::vector<std::pair<RegionId, std::vector<OutgoingFrame>>> frames;
    for (auto& [id, region] : regions_) frames.emplace_back(id, region->Start());
    for (const auto& [id, sent] : frames) Send(id, sent);
  }
  void Send(RegionId from, const std::vector<OutgoingFrame>& frames) {
    for (const OutgoingFrame& frame : frames) {
      const absl::Status status = regions_.at(frame.to)->Receive(from, frame.bytes);
      EXPECT_TRUE(status.ok()) << status;
    }
  }
  void Step() {
    std::vector<std::pair<RegionId, StepResult>> results;
    for (auto& [id, region] : regions_) {
      ASSERT_TRUE(region->CanStep());
      results.emplace_back(id, region->Step());
    }
    for (const auto& [id, result] : results) Send(id, result.frames);
    for (const BodyDef& def : scene_->bodies) {
      if (def.motion != Motion::kDynamic) continue;
      std::size_t owners = 0;
      for (const auto& [id, region] : regions_) owners += region->Owns(def.id) ? 1 : 0;
      ASSERT_EQ(owners, 1u) << "body " << def.id.value() << " after tick " << tick();
    }
  }
  void StepTo(std::uint64_t to) {
    while (tick() < to) ASSERT_NO_FATAL_FAILURE(Step());
  }
  std::uint64_t tick() const { return regions_.begin()->second->tick().value(); }
  const Region& OwnerOf(BodyId id) const {
    for (const auto& [region, one] : regions_) {
      if (one->Owns(id)) return *one;
    }
    return *regions_.begin()->second;
  }
  BodyState StateOf(BodyId id) const { return OwnerOf(id).world().StateOf(id); }
  const game::GameRecord& RecordOf(BodyId id) const { return OwnerOf(id).records().Find(id)->game; }
  Region& at(std::uint32_t id) { return *regions_.at(RegionId(id)); }
  // The two regions hold the body in the same state, to the bit.
  void ExpectAlike() {
    ASSERT_TRUE(at(1).world().Has(kMoved) && at(2).world().Has(kMoved));
    EXPECT_EQ(at(1).world().StateOf(kMoved), at(2).world().StateOf(kMoved)) << "after tick " << tick();
  }

  ScriptedGame game;

 private:
  std::shared_ptr<const Scene> scene_;
  tessera_game_module module_{};
  std::map<RegionId, std::unique_ptr<Region>> regions_;
};

Scene BallAt(Vec3d place, Vec3f velocity = {}) {
  Scene scene = Balls({place});
  scene.bodies[0].initial.linear_velocity = velocity;
  scene.bodies[0].may_sleep = false;
  return scene;
}

tessera_game_value Interface(const GameValue& value) { return game::ToInterface(value); }

// --- Verbs

TEST_F(RegionMotionTest, AForceForATimeActsOnceATickAlsoInAHandover) {
  Begin(BallAt({-0.4, 0, 0}, {3, 0, 0}), 2, [](GameCalls& calls, std::int64_t tick) {
    return tick != 2 || calls.Call(game::kBodyPushFor, {kMoved, std::int64_t{30}, Vec3d{0, 2, 0}});
  });
  StepTo(60);
  EXPECT_TRUE(at(2).Owns(kMoved));
  EXPECT_NEAR(StateOf(kMoved).linear_velocity.y, 30 * 2.0 / 60, 1e-5);
  EXPECT_TRUE(RecordOf(kMoved).forces.empty());
}

TEST_F(RegionMotionTest, ForcesAndSpinsAreSteppedAlikeByANeighbour) {
  Begin(BallAt({-0.6, 0, 0}), 2, [](GameCalls& calls, std::int64_t tick) {
    if (tick == 2) return calls.Call(game::kBodyPushFor, {kMoved, std::int64_t{5}, Vec3d{0, 2, 0}, Vec3d{0, 0.1, 0}});
    if (tick == 10) return calls.Call(game::kBodySetSpin, {kMoved, Vec3d{0, 0, 3}});
    return true;
  });
  for (std::uint64_t to = 1; to < 20; ++to) {
    StepTo(to);
    ExpectAlike();
  }
  EXPECT_NEAR(StateOf(kMoved).angular_velocity.z, 3, 1e-5);
  EXPECT_NEAR(StateOf(kMoved).angular_velocity.y, 0, 1e-5);
}

TEST_F(RegionMotionTest, AForceThatIsTakenBackActsNoMore) {
  Begin(BallAt({-5, 0, 0}), 1, [](GameCalls& calls, std::int64_t tick) {
    if (tick == 2) return calls.Call(game::kBodyPushFor, {kMoved, std::int64_t{500}, Vec3d{0, 6, 0}});
    return tick != 5 || calls.Call(game::kBodyCancelPush, {kMoved, std::int64_t{1}});
  });
  StepTo(20);
  EXPECT_NEAR(StateOf(kMoved).linear_velocity.y, 0.3, 1e-5);
}

TEST_F(RegionMotionTest, AWokenBodyWakesInBothRegions) {
  Scene scene = BallAt({-0.6, 0, 0});
  scene.bodies[0].may_sleep = true;
  Begin(std::move(scene), 2,
        [](GameCalls& calls, std::int64_t tick) { return tick != 90 || calls.Call(game::kBodyWake, {kMoved}); });
  StepTo(90);
  ASSERT_TRUE(StateOf(kMoved).asleep);
  StepTo(91);
  EXPECT_FALSE(at(1).world().StateOf(kMoved).asleep);
  EXPECT_FALSE(at(2).world().StateOf(kMoved).asleep);
}

// --- Gravity and material

TEST_F(RegionMotionTest, GravityIsKnownToANeighbourAndGoesWithTheBody) {
  Scene scene = BallAt({-0.6, 5, 0}, {1, 0, 0});
  scene.gravity_m_s2 = {0, -9.81, 0};
  Begin(std::move(scene), 2, [](GameCalls& calls, std::int64_t tick) {
    return tick != 3 || calls.Call(game::kBodySetGravity, {kMoved, 0.0});
  });
  StepTo(4);
  const float falling = StateOf(kMoved).linear_velocity.y;
  for (std::uint64_t to = 5; to < 120; ++to) {
    StepTo(to);
    ASSERT_EQ(StateOf(kMoved).linear_velocity.y, falling) << "after tick " << to;
    if (at(1).world().Has(kMoved) && at(2).world().Has(kMoved)) ExpectAlike();
  }
  EXPECT_TRUE(at(2).Owns(kMoved));
  const auto state = DecodeState(at(2).SaveState(), at(2).catalog());
  ASSERT_TRUE(state.ok()) << state.status();
  EXPECT_EQ(state->records.at(kMoved).game.tuning.gravity_scale, 0.0f);
}

// --- Teleports

TEST_F(RegionMotionTest, ATeleportIsNoMotionForANeighbourEither) {
  Begin(BallAt({-0.6, 0, 0}, {0, 0, 1}), 2, [](GameCalls& calls, std::int64_t tick) {
    return tick != 5 || calls.Call(game::kBodyTeleport, {kMoved, Vec3d{-0.7, 3, -2}});
  });
  StepTo(5);
  EXPECT_EQ(StateOf(kMoved).position.y, 3);
  EXPECT_EQ(RecordOf(kMoved).jumps, 1);
  for (std::uint64_t to = 6; to < 20; ++to) {
    StepTo(to);
    ExpectAlike();
    EXPECT_NEAR(StateOf(kMoved).position.z, -2 + static_cast<double>(to - 5) / 60, 1e-6);
  }
  EXPECT_FALSE(RecordOf(kMoved).jumped);
}

TEST_F(RegionMotionTest, ATeleportIntoAnotherRegionIsAHandover) {
  Begin(BallAt({-5, 0, 0}, {0, 0, 1}), 2, [](GameCalls& calls, std::int64_t tick) {
    return tick != 5 || calls.Call(game::kBodyTeleport, {kMoved, Vec3d{5, 0, 0}});
  });
  StepTo(12);
  EXPECT_TRUE(at(2).Owns(kMoved));
  EXPECT_FALSE(at(1).world().Has(kMoved)) << "a ghost of it stays where it was, or was put";
  EXPECT_NEAR(StateOf(kMoved).position.x, 5, 1e-9);
  EXPECT_EQ(RecordOf(kMoved).jumps, 1);
}

TEST_F(RegionMotionTest, AFarTeleportGoesFromRegionToRegion) {
  Begin(BallAt({-9, 0, -9}), 9, [](GameCalls& calls, std::int64_t tick) {
    return tick != 5 || calls.Call(game::kBodyTeleport, {kMoved, Vec3d{9, 0, 9}});
  });
  StepTo(20);
  const Region& owner = OwnerOf(kMoved);
  EXPECT_EQ(owner.id(), owner.map().OwnerOf({9, 0, 9}));
  EXPECT_EQ(StateOf(kMoved).position, Vec3d(9, 0, 9));
  EXPECT_EQ(RecordOf(kMoved).jumps, 1);
}

// Neighbours that were promised silence hear of it before it is there.
TEST_F(RegionMotionTest, ATeleportBreaksNoPromise) {
  for (std::int64_t when = 20; when < 26; ++when) {
    Begin(BallAt({-8, 0, 0}), 2, [when](GameCalls& calls, std::int64_t tick) {
      return tick != when || calls.Call(game::kBodyTeleport, {kMoved, Vec3d{-0.3, 0, 0}});
    });
    for (std::uint64_t to = 1; to < 32; ++to) {
      const bool was_there = tick() > 0 && StateOf(kMoved).position.x > -1;
      StepTo(to);
      if (was_there) {
        EXPECT_TRUE(at(2).world().Has(kMoved)) << "asked for in tick " << when << ", after tick " << to;
      }
    }
    EXPECT_GT(StateOf(kMoved).position.x, -1);
  }
}

TEST_F(RegionMotionTest, AnAssemblyIsPutElsewhereWhole) {
  Scene scene = Balls({{-6, 0, 0}, {-4.9, 0, 0}});
  Join(scene, 1, 2);
  scene.joints[0].frame_a.position = {0.55, 0, 0};
  scene.joints[0].frame_b.position = {-0.55, 0, 0};
  Begin(std::move(scene), 2, [](GameCalls& calls, std::int64_t tick) {
    if (tick != 5) return true;
    const std::vector<tessera_game_value> arguments{Interface(kMoved), Interface(Vec3d{5, 1, 0}), [] {
                                                      tessera_game_value turn{};
                                                      turn.type = TESSERA_GAME_ROTATION;
                                                      turn.as.rotation[1] = turn.as.rotation[3] = std::sqrt(0.5);
                                                      return turn;
                                                    }()};
    return calls.CallRaw(game::kBodyTeleport, arguments);
  });
  StepTo(15);
  EXPECT_TRUE(at(2).Owns(kMoved) && at(2).Owns(BodyId(2)));
  // A quarter turn about y takes x to -z.
  EXPECT_LT(Length(StateOf(BodyId(2)).position - Vec3d(5, 1, -1.1)), 1e-3);
  EXPECT_LT(Length(StateOf(kMoved).position - Vec3d(5, 1, 0)), 1e-3);
}

// --- Kinematic bodies

// A plate of 4 by 4 m, body 1, whose top is at y = 0, and a box on it.
Scene PlateWithBox(double x) {
  Scene scene = Balls({{x, -0.1, 0}, {x, 0.5, 0}});
  scene.gravity_m_s2 = {0, -9.81, 0};
  BodyDef& plate = scene.bodies[0];
  plate.shape = std::make_shared<const Shape>(Shape{BoxShape{{2, 0.1, 2}}});
  plate.kinematic = true;
  plate.mass_kg = plate.gravity_scale = 0;
  scene.bodies[1].shape = std::make_shared<const Shape>(Shape{BoxShape{{0.5, 0.5, 0.5}}});
  return scene;
}

void GiveAPath(Scene& scene) {
  BodyDef& plate = scene.bodies[0];
  plate.motion = Motion::kStatic;
  BodyPath path;
  path.points = {{0, {plate.initial.position, {}}}, {4, {plate.initial.position + Vec3d(6, 1, 0), {}}}};
  path.repeat = PathRepeat::kPingPong;
  plate.path = std::make_shared<const BodyPath>(std::move(path));
}

TEST_F(RegionMotionTest, APathIsTheSameInEveryRegionAndCarriesABoxOverTheBorder) {
  Scene scene = PlateWithBox(-3);
  GiveAPath(scene);
  std::vector<BodyState> alone;
  Begin(scene, 1);
  for (std::uint64_t to = 1; to <= 240; ++to) {
    StepTo(to);
    alone.push_back(StateOf(BodyId(2)));
  }
  EXPECT_GT(alone.back().position.x, 2.5) << "it was left behind";
  Begin(scene, 2);
  for (std::uint64_t to = 1; to <= 240; ++to) {
    StepTo(to);
    ASSERT_EQ(at(1).world().StateOf(kMoved), at(2).world().StateOf(kMoved));
    ASSERT_LT(Length(StateOf(BodyId(2)).position - alone[to - 1].position), 1e-4) << "after tick " << to;
  }
  EXPECT_TRUE(at(2).Owns(BodyId(2)));
}

TEST_F(RegionMotionTest, APlateThatAGameMovesArrivesInTimeWithItsBoxOverTheBorder) {
  const Act act = [](GameCalls& calls, std::int64_t tick) {
    if (tick != 30) return true;
    const std::vector<tessera_game_value> arguments{Interface(kMoved), Interface(Vec3d{3, 0.9, 0}),
                                                    tessera_game_value{}, Interface(std::int64_t{180})};
    return calls.CallRaw(game::kBodyMoveTo, arguments);
  };
  const Scene scene = PlateWithBox(-3);
  std::vector<BodyState> alone;
  Begin(scene, 1, act);
  for (std::uint64_t to = 1; to <= 260; ++to) {
    StepTo(to);
    alone.push_back(StateOf(BodyId(2)));
  }
  EXPECT_LT(Length(StateOf(kMoved).position - Vec3d(3, 0.9, 0)), 1e-9);
  Begin(scene, 2, act);
  StepTo(30 + 180);
  EXPECT_LT(Length(StateOf(kMoved).position - Vec3d(3, 0.9, 0)), 1e-6);
  StepTo(260);
  EXPECT_EQ(StateOf(kMoved).position, Vec3d(3, 0.9, 0));
  EXPECT_TRUE(StateOf(kMoved).asleep);
  EXPECT_FALSE(RecordOf(kMoved).target.has_value());
  EXPECT_TRUE(at(2).Owns(kMoved) && at(2).Owns(BodyId(2)));
  EXPECT_LT(Length(StateOf(BodyId(2)).position - alone.back().position), 5e-3);
  EXPECT_NEAR(StateOf(BodyId(2)).position.y, 1.5, 0.01) << "it is on the plate";
}

TEST_F(RegionMotionTest, APathGoesOnInASavedState) {
  Scene scene = PlateWithBox(-3);
  GiveAPath(scene);
  Begin(scene, 1);
  StepTo(100);
  const BodyState plate = at(1).world().StateOf(kMoved);
  const auto state = DecodeState(at(1).SaveState(), at(1).catalog());
  ASSERT_TRUE(state.ok()) << state.status();
  const auto shared = std::make_shared<const Scene>(scene);
  Region again({RegionId(1),
                Incarnation(2),
                shared,
                *MakeGridMap(shared->ground(), 1),
                {},
                std::make_shared<const RegionState>(*state)});
  EXPECT_EQ(again.world().StateOf(kMoved), plate);
  again.Start();
  again.Step();
  StepTo(101);
  EXPECT_EQ(again.world().StateOf(kMoved), at(1).world().StateOf(kMoved));
}

}  // namespace
}  // namespace tessera::region
