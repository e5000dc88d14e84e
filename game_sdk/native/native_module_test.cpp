#include "game_sdk/native/native_module.h"

#include <gmock/gmock.h>

#include <array>
#include <cstdlib>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/game/game_host.h"
#include "core/game/testing/fake_game_world.h"
#include "game_sdk/api/api.h"
#include "game_sdk/include/tessera/game.hpp"

namespace tessera::game {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr char kModules[] = TESSERA_BINARY_DIR "/game_modules";

std::string RefusalOf(std::string_view name, std::string_view hash = {}) {
  return std::string(NativeModule::Load(kModules, name, hash).status().message());
}

// A crate 1 and a ball 2 that the region owns, and a game.
class NativeModuleTest : public ::testing::Test {
 protected:
  NativeModuleTest() {
    world.Add(1, 1);
    world.Add(2, 2);
  }
  void Begin(const char* name) {
    const auto module = NativeModule::Load(kModules, name);
    ASSERT_TRUE(module.ok()) << module.status();
    auto loaded = GameHost::Load((*module)->module(), {name, ""}, world.shared_scene());
    ASSERT_TRUE(loaded.ok()) << loaded.status();
    host = *std::move(loaded);
  }
  // The lines of one tick with this event.
  std::vector<std::string> Run(std::uint32_t callback, std::uint64_t self, std::uint64_t other) {
    const std::array<GameEvent, 1> events{GameEvent{callback, BodyId(self), BodyId(other)}};
    host->Run(Tick(++tick), events, world);
    std::vector<std::string> lines;
    for (const GameLine& line : host->TakeLines()) lines.push_back(line.text);
    return lines;
  }
  std::int64_t health() const { return std::get<std::int64_t>(world.property(1, "health")); }

  FakeGameWorld world;
  std::unique_ptr<GameHost> host;
  std::uint64_t tick = 0;
};

TEST(NativeModuleLoadTest, ANameNamesNoFolder) {
  for (const char* name : {"", ".", "..", "../fails", "a/b", "/etc/passwd", "fails.so", "a b", "a\n"}) {
    EXPECT_THAT(RefusalOf(name), HasSubstr("its name must be 1 to 63 letters")) << name;
  }
  EXPECT_THAT(RefusalOf(std::string(64, 'a')), HasSubstr("its name must be"));
  EXPECT_TRUE(CheckModuleName(std::string(63, 'a')).ok());
}

TEST(NativeModuleLoadTest, WhatIsNotThereIsNamed) {
  EXPECT_EQ(NativeModule::Load(kModules, "absent").status().code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(RefusalOf("absent"), HasSubstr("game module absent: "));
}

TEST(NativeModuleLoadTest, ALibraryWithoutTheFunctionIsRefused) {
  EXPECT_EQ(RefusalOf("no_entry"), "game module no_entry: has no function tessera_game_module_1");
}

TEST(NativeModuleLoadTest, AnotherVersionOfTheInterfaceIsRefused) {
  EXPECT_EQ(RefusalOf("other_abi"),
            "game module other_abi: is made for version 8 of the interface, and this is version 1");
}

TEST(NativeModuleLoadTest, AnotherVersionOfMovementsIsRefused) {
  EXPECT_EQ(RefusalOf("bad_movement"),
            "game module bad_movement: movement: is made for version 8 of the interface, and this is version 1");
}

TEST(NativeModuleLoadTest, AModulesMovementComesWithIt) {
  const auto car = NativeModule::Load(kModules, "car"), fails = NativeModule::Load(kModules, "fails");
  ASSERT_TRUE(car.ok() && fails.ok()) << car.status() << fails.status();
  EXPECT_EQ((*fails)->module().movement, nullptr);
  ASSERT_NE((*car)->module().movement, nullptr);
  EXPECT_STREQ((*car)->module().movement->name, "car");
  // The scene of this test has no player whom it could move.
  const auto host = GameHost::Load((*car)->module(), {"car", ""}, FakeGameWorld().shared_scene());
  EXPECT_EQ(host.status().message(), "car: movement car: the scene has no player");
}

TEST(NativeModuleLoadTest, AMovementAloneIsLoadedForAGameInLuaAndIsNoGame) {
  const auto alone = NativeModule::LoadMovement(kModules, "car_alone");
  ASSERT_TRUE(alone.ok()) << alone.status();
  EXPECT_FALSE((*alone)->is_game());
  ASSERT_NE((*alone)->movement(), nullptr);
  EXPECT_STREQ((*alone)->movement()->name, "car");
  EXPECT_EQ(RefusalOf("car_alone"), "game module car_alone: has a movement alone, and is no game");
  // A game's own does as well.
  const auto car = NativeModule::LoadMovementFile(std::string(kModules) + "/car.so");
  ASSERT_TRUE(car.ok()) << car.status();
  EXPECT_TRUE((*car)->is_game());
  EXPECT_STREQ((*car)->movement()->name, "car");
}

TEST(NativeModuleLoadTest, WhatHasNoMovementOrABadOneIsNoMovement) {
  const auto refusal = [](const char* file) {
    return std::string(NativeModule::LoadMovementFile(file).status().message());
  };
  const std::string folder = kModules;
  EXPECT_EQ(refusal((folder + "/fails.so").c_str()), "game module fails: has no movement");
  EXPECT_EQ(refusal((folder + "/no_entry.so").c_str()), "game module no_entry: has no function tessera_game_module_1");
  EXPECT_EQ(refusal((folder + "/bad_movement_alone.so").c_str()),
            "game module bad_movement_alone: movement hover: state_bytes: 65 are more than 64");
  EXPECT_THAT(refusal((folder + "/absent.so").c_str()), HasSubstr("absent.so cannot be read"));
  EXPECT_EQ(refusal("car.lua"), "car.lua: is no .so");
}

// A game has one movement: that of its module, or the one beside its file.
TEST(NativeModuleLoadTest, AGameWithAMovementTakesNoOther) {
  const auto car = NativeModule::Load(kModules, "car");
  ASSERT_TRUE(car.ok()) << car.status();
  const auto host = GameHost::Load((*car)->module(), {"car", "", (*car)->movement()}, FakeGameWorld().shared_scene());
  EXPECT_EQ(host.status().message(), "car: movement: the game has one of its own, and takes no other");
}

TEST(NativeModuleLoadTest, AnotherBuildIsRefusedAndTheSameOneIsNot) {
  const std::string other(64, 'a');
  EXPECT_THAT(RefusalOf("fails", other), HasSubstr("and the world runs build aaaaaaaaaaaa"));
  const auto module = NativeModule::Load(kModules, "fails");
  ASSERT_TRUE(module.ok()) << module.status();
  EXPECT_EQ((*module)->hash().size(), 64u);
  EXPECT_TRUE(NativeModule::Load(kModules, "fails", (*module)->hash()).ok());
}

TEST(NativeModuleLoadTest, AGameThatThrowsWhileItLoadsSaysWhy) {
  const auto module = NativeModule::Load(kModules, "no_load");
  ASSERT_TRUE(module.ok()) << module.status();
  const auto host = GameHost::Load((*module)->module(), {"no_load", ""}, FakeGameWorld().shared_scene());
  EXPECT_EQ(host.status().message(), "the game does not want to");
}

TEST_F(NativeModuleTest, AnExceptionIsAnErrorAndUndoesTheCallback) {
  Begin("fails");
  EXPECT_THAT(Run(kOnBodyContact, 1, 2), ElementsAre("nobody caught this"));
  EXPECT_THAT(Run(kOnBodyContactEnded, 1, 2), ElementsAre("an exception that is no std::exception"));
  EXPECT_THAT(Run(kOnBodyEntered, 1, 2), ElementsAre(HasSubstr("no property \"mana\"")));
  EXPECT_EQ(health(), 100);
}

TEST_F(NativeModuleTest, WorkThatIsCountedEndsWithTheBudget) {
  Begin("fails");
  EXPECT_THAT(Run(kOnBodyLeft, 1, 2), ElementsAre("too much work"));
  EXPECT_EQ(health(), 100);
}

TEST_F(NativeModuleTest, TheWrapperReachesTheWholeTable) {
  Begin("fails");
  EXPECT_THAT(Run(kOnBodyContact, 2, 1), ElementsAre());
  EXPECT_EQ(world.ids().size(), 5U);
  EXPECT_EQ(std::get<std::string>(world.property(2, "name")), "changed");
  EXPECT_EQ(std::get<double>(world.property(2, "heat")), 2);
  EXPECT_EQ(world.record(2).push_ns, Vec3f(0, 4, 0));
  host->Run(Tick(++tick), {}, world);
  EXPECT_EQ(host->TakeLines().front().text, "then 1 all is well");
}

using NativeModuleDeathTest = NativeModuleTest;

TEST_F(NativeModuleDeathTest, ACrashNamesTheGameAndTheCallback) {
  Begin("crashes");
  EXPECT_THAT(Run(kOnBodyContact, 2, 1), ElementsAre());
  EXPECT_DEATH(Run(kOnBodyContact, 1, 2), "died in game module crashes: Segmentation fault in kinds.crate.on_contact");
  // Only while the library's code runs.
  EXPECT_DEATH(std::abort(), ::testing::Not(HasSubstr("died in game module")));
}

// The header cannot include the table, which is the engine's own.
TEST(GameHeaderTest, NumbersAreThoseOfTheTable) {
  const std::pair<std::uint32_t, std::string_view> functions[] = {
      {native::kWorldTick, "tick"},
      {native::kWorldTickRate, "tick_rate"},
      {native::kWorldRandom, "random"},
      {native::kWorldLog, "log"},
      {native::kWorldSpawn, "spawn"},
      {native::kWorldRay, "ray"},
      {native::kWorldRayAll, "ray_all"},
      {native::kWorldSweep, "sweep"},
      {native::kWorldOverlap, "overlap"},
      {native::kBodyIsHere, "is_here"},
      {native::kBodyIsOwn, "is_own"},
      {native::kBodyKind, "kind"},
      {native::kBodyPosition, "position"},
      {native::kBodyRotation, "rotation"},
      {native::kBodyVelocity, "velocity"},
      {native::kBodySpin, "spin"},
      {native::kBodyMass, "mass"},
      {native::kBodyPlayer, "player"},
      {native::kBodyGet, "get"},
      {native::kBodySet, "set"},
      {native::kBodyImpulse, "impulse"},
      {native::kBodySetVelocity, "set_velocity"},
      {native::kBodyAfter, "after"},
      {native::kBodyCancel, "cancel"},
      {native::kBodyRemove, "remove"},
      {native::kBodyExpireAfter, "expire_after"},
      {native::kBodyMember, "member"},
      {native::kBodyConnect, "connect"},
      {native::kBodyDisconnect, "disconnect"},
      {native::kBodyIsConnected, "is_connected"},
  };
  for (const auto& [number, name] : functions) {
    ASSERT_NE(FindFunction(number), nullptr) << name;
    EXPECT_EQ(FindFunction(number)->name, name);
  }
  const std::pair<std::uint32_t, std::string_view> callbacks[] = {
      {native::kOnTick, "on_tick"},           {native::kOnBodyTick, "on_tick"},
      {native::kOnBodyContact, "on_contact"}, {native::kOnBodyContactEnded, "on_contact_ended"},
      {native::kOnBodyEntered, "on_entered"}, {native::kOnBodyLeft, "on_left"},
      {native::kOnBodyTimer, "on_timer"},
  };
  for (const auto& [number, name] : callbacks) {
    ASSERT_NE(FindCallback(number), nullptr) << name;
    EXPECT_EQ(FindCallback(number)->name, name);
  }
}

}  // namespace
}  // namespace tessera::game
