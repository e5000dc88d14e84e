// A game's calls that move bodies come to stand in their records, and the error of a wrong call names the argument.
#include "core/game/motion_calls.h"

#include <gmock/gmock.h>

#include <cstring>
#include <functional>
#include <limits>

#include "core/game/game_host.h"
#include "core/game/settings.h"
#include "core/game/testing/fake_game_world.h"
#include "core/game/testing/named_fields.h"
#include "core/game/testing/scripted_game.h"

namespace tessera::game::motion_calls {
namespace {

using ::testing::HasSubstr;
using ::testing::SizeIs;

constexpr double kNotANumber = std::numeric_limits<double>::quiet_NaN();
constexpr double kEndless = std::numeric_limits<double>::infinity();

tessera_game_value Text(const char* text) {
  tessera_game_value value{};
  value.type = TESSERA_GAME_TEXT;
  value.count = static_cast<std::uint32_t>(std::strlen(text));
  value.as.text = text;
  return value;
}
tessera_game_value Real(double real) {
  tessera_game_value value{};
  value.type = TESSERA_GAME_REAL;
  value.as.real = real;
  return value;
}
tessera_game_value Rotation(double x, double y, double z, double w) {
  tessera_game_value value{};
  value.type = TESSERA_GAME_ROTATION;
  value.as.rotation[0] = x, value.as.rotation[1] = y, value.as.rotation[2] = z, value.as.rotation[3] = w;
  return value;
}
tessera_game_value Vector(double x, double y, double z) { return ToInterface(GameValue(Vec3d{x, y, z})); }
tessera_game_value Whole(std::int64_t whole) { return ToInterface(GameValue(whole)); }
tessera_game_value Body(std::uint64_t id) { return ToInterface(GameValue(BodyId(id))); }
tessera_game_value Nothing() { return {}; }

class MotionCallsTest : public ::testing::Test {
 protected:
  void SetUp() override {
    world.Add(1, 1);
    world.Add(2, 0, false);  // a neighbour's
    world.Add(3, 0);
    world.def(3).kinematic = true;
    world.def(3).mass_kg = 0;
    world.Add(4, 0);
    world.def(4).motion = Motion::kStatic;
  }
  // Runs `ask` as a callback of body 1 after tick 10. Returns whether it was committed.
  bool InACallback(const std::function<bool(GameCalls&)>& ask) {
    ScriptedGame game;
    game.On(kOnBodyContact, "crate", [&](GameCalls& calls, ScriptedGame::Arguments) { return ask(calls); });
    const tessera_game_module module = game.module();
    auto host = GameHost::Load(module, {"game.lua", "fine"}, world.shared_scene());
    EXPECT_TRUE(host.ok()) << host.status();
    (*host)->Run(Tick(10), std::vector<GameEvent>{{kOnBodyContact, BodyId(1), BodyId(2)}}, world);
    return (*host)->statistics().calls == 1 && (*host)->statistics().errors == 0;
  }
  bool Call(std::uint32_t function, std::vector<tessera_game_value> arguments) {
    return InACallback([&](GameCalls& calls) {
      const bool done = calls.CallRaw(function, arguments);
      result = calls.result();
      EXPECT_TRUE(done) << calls.error();
      return done;
    });
  }
  std::string ErrorOf(std::uint32_t function, std::vector<tessera_game_value> arguments) {
    std::string error;
    const GameRecord before = world.record(1);
    EXPECT_TRUE(InACallback([&](GameCalls& calls) {
      EXPECT_FALSE(calls.CallRaw(function, arguments));
      error = calls.error();
      return true;
    }));
    EXPECT_EQ(world.record(1), before) << "something was done all the same";
    return error;
  }

  FakeGameWorld world;
  tessera_game_value result{};
};

// --- push_for

TEST_F(MotionCallsTest, AForceActsInEachOfTheNextTicks) {
  ASSERT_TRUE(Call(kBodyPushFor, {Body(1), Whole(3), Vector(0, 5, 0), Vector(1, 0, 0)}));
  EXPECT_EQ(result.as.whole, 1);
  GameRecord record = world.record(1);
  for (std::uint64_t tick = 11; tick <= 13; ++tick) {
    EXPECT_TRUE(record.acts());
    EXPECT_EQ(record.NextForce(60), Vec3f(0, 5, 0));
    EXPECT_EQ(record.NextTorque(60), Vec3f(1, 0, 0));
    record.Acted(Tick(tick));
  }
  EXPECT_FALSE(record.acts());
  EXPECT_EQ(record.NextForce(60), Vec3f());
}

TEST_F(MotionCallsTest, AForceIsTakenBackByItsNumber) {
  ASSERT_TRUE(Call(kBodyPushFor, {Body(1), Whole(3), Vector(0, 5, 0)}));
  ASSERT_TRUE(Call(kBodyPushFor, {Body(1), Whole(9), Vector(0, 2, 0)}));
  EXPECT_EQ(result.as.whole, 2);
  ASSERT_TRUE(Call(kBodyCancelPush, {Body(1), Whole(1)}));
  EXPECT_EQ(result.as.whole, 1);
  ASSERT_TRUE(Call(kBodyCancelPush, {Body(1), Whole(1)}));
  EXPECT_EQ(result.as.whole, 0);
  ASSERT_THAT(world.record(1).forces, SizeIs(1));
  EXPECT_EQ(world.record(1).forces[0].force_n, Vec3f(0, 2, 0));
  ASSERT_TRUE(Call(kBodyPushFor, {Body(1), Whole(1), Vector(1, 0, 0)}));
  EXPECT_EQ(result.as.whole, 3) << "a number is given once";
}

TEST_F(MotionCallsTest, BadForcesAreRefused) {
  EXPECT_EQ(ErrorOf(kBodyPushFor, {Body(1), Whole(1'000'000), Vector(0, 1, 0)}),
            "push_for: `ticks` must be 1 to 36000, got 1000000");
  EXPECT_EQ(ErrorOf(kBodyPushFor, {Body(1), Whole(0), Vector(0, 1, 0)}), "push_for: `ticks` must be 1 to 36000, got 0");
  EXPECT_EQ(ErrorOf(kBodyPushFor, {Body(1), Whole(5), Vector(0, kNotANumber, 0)}), "push_for: `force` is not finite");
  EXPECT_EQ(ErrorOf(kBodyPushFor, {Body(1), Whole(5), Vector(0, 1, 0), Vector(kEndless, 0, 0)}),
            "push_for: `torque` is not finite");
  EXPECT_THAT(ErrorOf(kBodyPushFor, {Body(1), Whole(5), Vector(0, 1e9, 0)}), HasSubstr("m/s^2"));
  EXPECT_THAT(ErrorOf(kBodyPushFor, {Body(1), Whole(5), Vector(0, 1, 0), Vector(1e20, 0, 0)}), HasSubstr("`torque`"));
  for (std::size_t i = 0; i < kMaxForces; ++i) {
    ASSERT_TRUE(Call(kBodyPushFor, {Body(1), Whole(5), Vector(0, 1, 0)}));
  }
  EXPECT_EQ(ErrorOf(kBodyPushFor, {Body(1), Whole(5), Vector(0, 1, 0)}), "push_for: the body has 4 pushes already");
}

// --- set_spin and wake

TEST_F(MotionCallsTest, ASpinIsAPushThatGivesIt) {
  ASSERT_TRUE(Call(kBodySetSpin, {Body(1), Vector(0, 3, 0)}));
  EXPECT_EQ(world.record(1).push_nms, Vec3f(0, 6, 0));
  EXPECT_EQ(ErrorOf(kBodySetSpin, {Body(1), Vector(0, 2e3, 0)}), "set_spin: `spin` is above 1000 rad/s");
  EXPECT_EQ(ErrorOf(kBodySetSpin, {Body(1), Vector(kNotANumber, 0, 0)}), "set_spin: `spin` is not finite");
}

TEST_F(MotionCallsTest, WakesForOneTick) {
  ASSERT_TRUE(Call(kBodyWake, {Body(1)}));
  GameRecord record = world.record(1);
  EXPECT_TRUE(record.wakes && record.acts());
  record.Acted(Tick(11));
  EXPECT_TRUE(record.empty());
}

// --- teleport

TEST_F(MotionCallsTest, ATeleportWaitsInTheRecord) {
  ASSERT_TRUE(Call(kBodyTeleport, {Body(1), Vector(1, 2, 3)}));
  EXPECT_EQ(world.record(1).teleport, (GameTeleport{{1, 2, 3}, {}, {}, {}}));
  const NamedFields options{{"velocity", Vector(4, 0, 0)}, {"spin", Vector(0, 1, 0)}};
  ASSERT_TRUE(Call(kBodyTeleport, {Body(1), Vector(1, 2, 3), Rotation(0, 1, 0, 0), options.value()}));
  EXPECT_EQ(world.record(1).teleport, (GameTeleport{{1, 2, 3}, Quatd(0, 1, 0, 0), Vec3f(4, 0, 0), Vec3f(0, 1, 0)}));
}

TEST_F(MotionCallsTest, AVelocityThatIsSetAfterATeleportIsTheOneThatItHasThere) {
  ASSERT_TRUE(Call(kBodyTeleport, {Body(1), Vector(1, 2, 3)}));
  ASSERT_TRUE(Call(kBodySetVelocity, {Body(1), Vector(0, 7, 0)}));
  ASSERT_TRUE(Call(kBodySetSpin, {Body(1), Vector(2, 0, 0)}));
  EXPECT_EQ(world.record(1).teleport->velocity_m_s, Vec3f(0, 7, 0));
  EXPECT_EQ(world.record(1).teleport->spin_rad_s, Vec3f(2, 0, 0));
  EXPECT_EQ(world.record(1).push_ns, Vec3f());
}

TEST_F(MotionCallsTest, BadTeleportsAreRefused) {
  EXPECT_EQ(ErrorOf(kBodyTeleport, {Body(1), Vector(0, 101, 0)}),
            "teleport: (0, 101, 0) is outside the scene's bounds");
  EXPECT_EQ(ErrorOf(kBodyTeleport, {Body(1), Vector(0, kNotANumber, 0)}), "teleport: `position` is not finite");
  EXPECT_EQ(ErrorOf(kBodyTeleport, {Body(1), Vector(0, 0, 0), Rotation(0, 0, 0, 2)}),
            "teleport: `rotation` is not of length 1");
  EXPECT_EQ(ErrorOf(kBodyTeleport, {Body(1), Vector(0, 0, 0), Rotation(0, 0, kNotANumber, 1)}),
            "teleport: `rotation` is not finite");
  const NamedFields fast{{"velocity", Vector(2e3, 0, 0)}}, nan{{"spin", Vector(kNotANumber, 0, 0)}},
      unknown{{"speed", Real(1)}}, text{{"velocity", Text("fast")}};
  const auto with = [&](const NamedFields& options) {
    return ErrorOf(kBodyTeleport, {Body(1), Vector(0, 0, 0), Nothing(), options.value()});
  };
  EXPECT_EQ(with(fast), "teleport: `options.velocity` is above 1000 m/s");
  EXPECT_EQ(with(nan), "teleport: `options.spin` is not finite");
  EXPECT_EQ(with(unknown), "teleport: `options.speed` is none of velocity, spin");
  EXPECT_EQ(with(text), "teleport: `options.velocity` must be a vector");
  world.anchored = BodyId(1);
  EXPECT_EQ(ErrorOf(kBodyTeleport, {Body(1), Vector(0, 0, 0)}), "teleport: joints hold body 1 where it is");
}

// --- set_gravity and set_material

TEST_F(MotionCallsTest, GravityAndMaterialStayWithTheBody) {
  ASSERT_TRUE(Call(kBodySetGravity, {Body(1), Real(0)}));
  const NamedFields slippery{{"friction", Real(0)}}, bouncy{{"restitution", Whole(1)}};
  ASSERT_TRUE(Call(kBodySetMaterial, {Body(1), slippery.value()}));
  ASSERT_TRUE(Call(kBodySetMaterial, {Body(1), bouncy.value()}));
  EXPECT_EQ(world.record(1).tuning, (BodyTuning{.gravity_scale = 0.0f, .friction = 0.0f, .restitution = 1.0f}));
  GameRecord record = world.record(1);
  EXPECT_TRUE(record.wakes);
  record.Acted(Tick(11));
  EXPECT_FALSE(record.acts());
  EXPECT_FALSE(record.empty());
}

TEST_F(MotionCallsTest, BadGravityAndMaterialsAreRefused) {
  EXPECT_EQ(ErrorOf(kBodySetGravity, {Body(1), Real(10.5)}), "set_gravity: `factor` must be -10 to 10, got 10.5");
  EXPECT_EQ(ErrorOf(kBodySetGravity, {Body(1), Real(kNotANumber)}), "set_gravity: `factor` is not finite");
  const auto with = [&](const NamedFields& material) { return ErrorOf(kBodySetMaterial, {Body(1), material.value()}); };
  EXPECT_EQ(with({{"friction", Real(11)}}), "set_material: `material.friction` must be 0 to 10, got 11");
  EXPECT_EQ(with({{"restitution", Real(-0.5)}}), "set_material: `material.restitution` must be 0 to 1, got -0.5");
  EXPECT_EQ(with({{"restitution", Real(kNotANumber)}}), "set_material: `material.restitution` must be 0 to 1, got nan");
  EXPECT_EQ(with({{"friction", Text("ice")}}), "set_material: `material.friction` must be a number");
  EXPECT_EQ(with({{"colour", Real(1)}}), "set_material: `material.colour` is none of friction, restitution");
}

// --- move_to

TEST_F(MotionCallsTest, AKinematicBodyGetsATarget) {
  ASSERT_TRUE(Call(kBodyMoveTo, {Body(3), Vector(0, 5, 0), Nothing(), Whole(60)}));
  EXPECT_EQ(world.record(3).target, (GameTarget{Tick(70), {0, 5, 0}, Quatd()}));
  ASSERT_TRUE(Call(kBodyMoveTo, {Body(3), Vector(0, 5, 0), Rotation(0, 1, 0, 0), Whole(30)}));
  EXPECT_EQ(world.record(3).target, (GameTarget{Tick(40), {0, 5, 0}, Quatd(0, 1, 0, 0)}));
}

TEST_F(MotionCallsTest, BadMovesAreRefused) {
  EXPECT_EQ(ErrorOf(kBodyMoveTo, {Body(1), Vector(0, 5, 0), Nothing(), Whole(60)}), "move_to: body 1 is not kinematic");
  EXPECT_EQ(ErrorOf(kBodyMoveTo, {Body(3), Vector(0, 500, 0), Nothing(), Whole(60)}),
            "move_to: (0, 500, 0) is outside the scene's bounds");
  EXPECT_EQ(ErrorOf(kBodyMoveTo, {Body(3), Vector(0, 5, kNotANumber), Nothing(), Whole(60)}),
            "move_to: `position` is not finite");
  EXPECT_EQ(ErrorOf(kBodyMoveTo, {Body(3), Vector(0, 5, 0), Rotation(1, 1, 0, 0), Whole(60)}),
            "move_to: `rotation` is not of length 1");
  EXPECT_EQ(ErrorOf(kBodyMoveTo, {Body(3), Vector(0, 5, 0), Nothing(), Whole(0)}),
            "move_to: `ticks` must be 1 to 36000, got 0");
  EXPECT_EQ(ErrorOf(kBodyMoveTo, {Body(3), Vector(0, 50, 0), Nothing(), Whole(1)}),
            "move_to: it would have to move at 3000 m/s, at most 100");
}

// --- Bodies that cannot be moved so

TEST_F(MotionCallsTest, OnlyBodiesThatTheRegionOwnsAndThatMove) {
  EXPECT_EQ(ErrorOf(kBodyWake, {Body(77)}), "wake: there is no body 77");
  EXPECT_EQ(ErrorOf(kBodyCancelPush, {Body(77), Whole(1)}), "cancel_push: body 77 is not here");
  EXPECT_EQ(ErrorOf(kBodyCancelPush, {Body(2), Whole(1)}), "cancel_push: body 2 is not owned by this region");
  EXPECT_EQ(ErrorOf(kBodyTeleport, {Body(4), Vector(0, 0, 0)}), "teleport: body 4 does not move");
  EXPECT_EQ(ErrorOf(kBodyPushFor, {Body(3), Whole(5), Vector(0, 1, 0)}),
            "push_for: body 3 is kinematic: move_to moves it");
  EXPECT_EQ(ErrorOf(kBodyImpulse, {Body(3), Vector(0, 1, 0)}), "impulse: body 3 does not move");
  EXPECT_EQ(ErrorOf(kBodySetGravity, {Body(3), Real(1)}), "set_gravity: body 3 is kinematic: move_to moves it");
}

// --- Bodies that the same call makes

TEST_F(MotionCallsTest, ABodyThatWasJustMadeIsPutAndTurnedAtOnce) {
  ASSERT_TRUE(InACallback([](GameCalls& calls) {
    EXPECT_TRUE(calls.Call(kWorldSpawn, {std::string("ball"), Vec3d{0, 0, 0}}));
    const tessera_game_value made = calls.result();
    const std::vector<tessera_game_value> to{made, Vector(5, 0, 0)}, spin{made, Vector(0, 2, 0)};
    EXPECT_TRUE(calls.CallRaw(kBodyTeleport, to)) << calls.error();
    EXPECT_TRUE(calls.CallRaw(kBodySetSpin, spin)) << calls.error();
    const std::vector<tessera_game_value> which{made};
    EXPECT_TRUE(calls.CallRaw(kBodyPosition, which));
    EXPECT_EQ(calls.result().as.vector[0], 5);
    EXPECT_TRUE(calls.CallRaw(kBodySpin, which));
    EXPECT_EQ(calls.result().as.vector[1], 2);
    return true;
  }));
}

// --- Records

TEST_F(MotionCallsTest, ARecordComesBackFromItsBytes) {
  GameRecord record;
  record.push_ns = {1, 2, 3};
  record.wakes = record.jumped = true;
  record.last_force = 7;
  record.forces = {{3, Tick(50), {1, 0, 0}, {0, 1, 0}}, {7, Tick(20), {0, 2, 0}, {}}};
  record.teleport = GameTeleport{{1, 2, 3}, Quatd(0, 1, 0, 0), {}, Vec3f(1, 1, 1)};
  record.target = GameTarget{Tick(99), {4, 5, 6}, Quatd(1, 0, 0, 0)};
  record.jumps = 200;
  record.tuning = {.gravity_scale = -1.0f, .friction = {}, .restitution = 0.5f};
  ByteWriter out;
  Write(out, record);
  const std::vector<std::uint8_t> bytes = out.Take();
  ByteReader in(bytes);
  EXPECT_EQ(ReadRecord(in), record);
  EXPECT_TRUE(in.ok() && in.remaining() == 0);
  EXPECT_TRUE(CheckRecord(record).ok());
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    ByteReader cut(std::span<const std::uint8_t>(bytes.data(), size));
    (void)ReadRecord(cut);
    EXPECT_FALSE(cut.ok()) << size;
  }
}

TEST_F(MotionCallsTest, AbsurdRecordsAreRefused) {
  const auto error = [](const std::function<void(GameRecord&)>& change) {
    GameRecord record;
    record.last_force = 9;
    change(record);
    return std::string(CheckRecord(record).message());
  };
  const auto nan = static_cast<float>(kNotANumber);
  EXPECT_EQ(error([](GameRecord& r) { r.forces.resize(5); }), "forces: more than 4");
  EXPECT_EQ(error([](GameRecord& r) { r.forces = {{10, Tick(1), {}, {}}}; }), "forces: 10 is no number of a force");
  EXPECT_EQ(error([&](GameRecord& r) {
              r.forces = {{1, Tick(1), {nan, 0, 0}, {}}};
            }),
            "forces: one is not finite, or too strong");
  EXPECT_EQ(error([](GameRecord& r) {
              r.teleport = GameTeleport{{kNotANumber, 0, 0}, {}, {}, {}};
            }),
            "teleport: is not finite, or beyond limits");
  EXPECT_EQ(error([](GameRecord& r) {
              r.target = GameTarget{Tick(1), {0, kEndless, 0}, Quatd()};
            }),
            "target: is not finite, or beyond limits");
  EXPECT_EQ(error([&](GameRecord& r) { r.tuning.friction = nan; }), "tuning: is not finite, or beyond limits");
}

// --- show_to

TEST_F(MotionCallsTest, ABodyIsShownToThoseWhomTheGameNames) {
  world.SetTeams();
  ASSERT_TRUE(Call(kBodyShowTo, {Body(1), Text("team")}));
  EXPECT_EQ(world.record(1).tuning.visible_to, Visibility::kTeam);
  ASSERT_TRUE(Call(kBodyShowTo, {Body(1), Text("servers")}));
  EXPECT_EQ(world.record(1).tuning.visible_to, Visibility::kServers);
  ASSERT_TRUE(Call(kBodyShowTo, {Body(1), Text("everyone")}));
  EXPECT_TRUE(world.record(1).empty()) << "as the scene has it";
}

TEST_F(MotionCallsTest, WhoIsNobodyAndTeamsThatAreNotThereAreRefused) {
  EXPECT_EQ(ErrorOf(kBodyShowTo, {Body(1), Text("friends")}),
            "show_to: `who` must be everyone, team or servers, got friends");
  EXPECT_EQ(ErrorOf(kBodyShowTo, {Body(1), Text("team")}), "show_to: the scene has no team_property");
  EXPECT_EQ(ErrorOf(kBodyShowTo, {Body(4), Text("servers")}),
            "show_to: the body does not move, and every client has the scene");
}

}  // namespace
}  // namespace tessera::game::motion_calls
