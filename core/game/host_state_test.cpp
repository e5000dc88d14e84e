#include "core/game/host_state.h"

#include <gmock/gmock.h>

#include <limits>
#include <span>

#include "core/game/game_host.h"
#include "core/game/testing/fake_game_world.h"
#include "core/game/testing/scripted_game.h"
#include "game_sdk/api/api.h"

namespace tessera::game::host_states {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

HostState SampleState() {
  HostState state;
  state.waiting = {{kOnBodyContact, BodyId(1), BodyId(2)}, {kOnBodyBlast, BodyId(2), BodyId()}};
  state.waiting[0].contact = {{1, 2, 3}, {0, 1, 0}, 4};
  state.waiting[1].blown = {{1, 2, 3}, 0.5, "barrel"};
  state.failed = {{kOnTick, 0, 3, false}, {kOnBodyContact, 1, 20, true}};
  state.next_ticked = BodyId(9);
  return state;
}

TEST(HostStateTest, ComesBackAsItWasWritten) {
  for (const HostState& state : {HostState(), SampleState()}) {
    ByteWriter out;
    Write(out, state);
    const std::vector<std::uint8_t> bytes = out.Take();
    ByteReader in(bytes);
    EXPECT_EQ(ReadHostState(in), state);
    EXPECT_TRUE(in.ok());
    EXPECT_EQ(in.remaining(), 0U);
    EXPECT_TRUE(CheckHostState(state, 3).ok());
    for (std::size_t size = 0; size < bytes.size(); ++size) {
      const std::span<const std::uint8_t> all(bytes);
      ByteReader cut(all.first(size));
      ReadHostState(cut);
      EXPECT_FALSE(cut.ok()) << size;
    }
  }
}

TEST(HostStateTest, WhatNoHostCanHaveIsRefused) {
  const auto refused = [](auto change) {
    HostState state = SampleState();
    change(state);
    return !CheckHostState(state, 3).ok();
  };
  EXPECT_TRUE(refused([](HostState& state) { state.waiting[0].callback = kOnTick; }));
  EXPECT_TRUE(refused([](HostState& state) { state.waiting[1].blown.reset(); }));
  EXPECT_TRUE(
      refused([](HostState& state) { state.waiting[0].contact->impulse = std::numeric_limits<double>::quiet_NaN(); }));
  EXPECT_TRUE(refused([](HostState& state) { std::swap(state.failed[0], state.failed[1]); }));
  EXPECT_TRUE(refused([](HostState& state) { state.failed[1].kind = 3; }));
  EXPECT_TRUE(refused([](HostState& state) { state.failed[1].kind = 0; }));
  EXPECT_TRUE(refused([](HostState& state) { state.failed[1].callback = 999; }));
}

class HostStateOfHostTest : public ::testing::Test {
 protected:
  HostStateOfHostTest() {
    for (const std::uint64_t id : {1, 2, 3}) world.Add(id, 1);
    game.On(kOnBodyContact, "crate", [this](GameCalls& calls, ScriptedGame::Arguments arguments) {
      called.push_back(arguments[0].as.id);
      calls.Charge(60'000);
      return !fails;
    });
    module_ = game.module();
  }
  std::unique_ptr<GameHost> Load() {
    GameSettings settings;
    settings.instructions_per_callback = 100'000;
    return *GameHost::Load(module_, {"game.lua", "fine"}, world.shared_scene(), settings);
  }
  static std::vector<GameEvent> Touches() {
    std::vector<GameEvent> events;
    for (const std::uint64_t id : {1, 2, 3}) events.push_back({kOnBodyContact, BodyId(id), BodyId(9)});
    return events;
  }
  FakeGameWorld world;
  ScriptedGame game;
  std::vector<std::uint64_t> called;
  bool fails = false;

 private:
  tessera_game_module module_{};
};

TEST_F(HostStateOfHostTest, EventsThatWaitGoOnInAnotherHost) {
  world.Add(9, 2);
  const std::unique_ptr<GameHost> first = Load(), second = Load();
  first->Run(Tick(1), Touches(), world);
  EXPECT_THAT(called, ElementsAre(1U, 2U)) << "the third is beyond the tick's work";
  EXPECT_THAT(first->State().waiting, SizeIs(1));
  second->Adopt(first->State(), [](const GameEvent&) { return true; });
  second->Run(Tick(2), {}, world);
  EXPECT_THAT(called, ElementsAre(1U, 2U, 3U));
  EXPECT_THAT(second->State().waiting, IsEmpty());
  const std::unique_ptr<GameHost> third = Load();
  third->Adopt(first->State(), [](const GameEvent&) { return false; });
  EXPECT_THAT(third->State().waiting, IsEmpty()) << "another region has the body";
}

TEST_F(HostStateOfHostTest, ABodyTakesItsEventsAlongInTheirOrder) {
  world.Add(8, 0, false);
  world.def(8).motion = Motion::kStatic;
  world.Add(9, 2);
  const std::unique_ptr<GameHost> host = Load();
  const std::vector<GameEvent> of_one{{kOnBodyContact, BodyId(1), BodyId(9)},
                                      {kOnBodyContactEnded, BodyId(1), BodyId(9)}};
  const GameEvent of_static{kOnBodyLeft, BodyId(8), BodyId(1)}, of_two{kOnBodyContact, BodyId(2), BodyId(1)};
  host->Wait(of_one);
  host->Wait({&of_two, 1});
  host->Wait({&of_static, 1});
  EXPECT_THAT(host->TakeWaiting(BodyId(1), world), ElementsAre(of_one[0], of_one[1], of_static))
      << "what does not move has its events where the other body is";
  EXPECT_THAT(host->State().waiting, ElementsAre(of_two));
  EXPECT_THAT(host->TakeWaiting(BodyId(1), world), IsEmpty());
  const std::vector<GameEvent> many(kMaxCarriedEvents + 3, of_one[0]);
  host->Wait(many);
  EXPECT_THAT(host->TakeWaiting(BodyId(1), world), SizeIs(kMaxCarriedEvents));
  EXPECT_EQ(host->statistics().dropped_events, 3U);
  EXPECT_THAT(host->State().waiting, ElementsAre(of_two));
}

TEST_F(HostStateOfHostTest, ACallbackThatIsOffStaysOffInAnotherHost) {
  world.Add(9, 2);
  fails = true;
  const std::unique_ptr<GameHost> first = Load(), second = Load();
  std::uint64_t tick = 0;
  while (first->statistics().callbacks_off == 0) {
    ASSERT_LT(tick, 100U);
    first->Run(Tick(++tick), Touches(), world);
  }
  ASSERT_THAT(first->State().failed, SizeIs(1));
  EXPECT_TRUE(first->State().failed[0].off);
  called.clear();
  second->Adopt(first->State(), [](const GameEvent&) { return false; });
  EXPECT_EQ(second->statistics().callbacks_off, 1U);
  second->Run(Tick(++tick), Touches(), world);
  EXPECT_THAT(called, IsEmpty());
}

TEST_F(HostStateOfHostTest, FailuresInARowAreCountedOn) {
  world.Add(9, 2);
  fails = true;
  const std::unique_ptr<GameHost> first = Load(), second = Load();
  const std::vector<GameEvent> touch{{kOnBodyContact, BodyId(1), BodyId(9)}};
  first->Run(Tick(1), touch, world);
  second->Adopt(first->State(), [](const GameEvent&) { return true; });
  fails = false;
  EXPECT_EQ(second->State().failed[0].failures, 1U);
  second->Run(Tick(2), touch, world);
  EXPECT_THAT(second->State().failed, IsEmpty()) << "one that succeeds ends the row";
}

}  // namespace
}  // namespace tessera::game::host_states
