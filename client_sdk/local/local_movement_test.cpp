// A car in a local world moves as in a worker's region. local_world_test.cpp has what games see of it.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <fstream>
#include <map>
#include <memory>
#include <sstream>
#include <string>

#include "client_sdk/client.h"
#include "client_sdk/local/local_world.h"
#include "core/game/game_host.h"
#include "core/region/region.h"
#include "core/world/partition_map.h"
#include "core/world/scene_load.h"
#include "game_sdk/examples/car/car_movement.h"
#include "game_sdk/native/native_module.h"

namespace tessera::local {
namespace {

constexpr PlayerNumber kDriver(1);
constexpr std::chrono::nanoseconds kQuarterTick(1'000'000'000 / 60 / 4);

std::string CarScene() {
  std::ifstream file(TESSERA_SOURCE_DIR "/game_sdk/examples/car/scene.textproto");
  std::ostringstream text;
  text << file.rdbuf();
  return std::move(text).str();
}

// Gas, wheel and now and then the brake.
client::Steering SteeringAt(std::uint64_t tick) {
  client::Steering steering;
  const std::uint64_t step = tick / 30;
  steering.move = {step % 3 == 0 ? 0.5F : -0.4F, step % 7 == 6 ? -0.5F : 0.8F};
  steering.buttons = step % 5 == 4 ? 1 : 0;
  return steering;
}

// The car's state of one tick, with what its springs remember.
struct Moment {
  BodyState body;
  MovementState memory;
  std::uint32_t input = 0;  // the last that has acted
};

Moment MomentOf(const region::Region& region) {
  Moment moment{
      .body = region.world().StateOf(PlayerBodyId(kDriver)), .memory = {}, .input = region.LastInput(kDriver)};
  if (const auto moved = region.MovementOf(kDriver)) moment.memory = moved->state;
  return moment;
}

// A local world with a driver. Once the car is there no call of Advance makes more than one tick, so each is seen.
struct Drive {
  std::unique_ptr<LocalWorld> world;
  std::unique_ptr<client::Client> client;
  std::map<std::uint64_t, Moment> moments;              // by tick, from the one on in which the car is there
  std::map<std::uint32_t, client::Steering> steerings;  // by the number of the input

  void Begin(const std::string& game) {
    auto opened = LocalWorld::Open({.scene = CarScene(), .game = game, .movement = &car_movement});
    ASSERT_TRUE(opened.ok()) << opened.status();
    world = *std::move(opened);
    const auto grant = world->Grant();
    ASSERT_TRUE(grant.ok()) << grant.status();
    client::GrantOptions options;
    options.bind_address = "127.0.0.1";
    options.predict = true;
    auto joined = client::Client::JoinByGrant(*grant, options);
    ASSERT_TRUE(joined.ok()) << joined.status();
    client = *std::move(joined);
    ASSERT_TRUE(client->SetMovement(&car_movement).ok());
  }
  // An input that the client makes until the next call has what it was told last.
  void Steer(const client::Steering& steering) {
    const std::uint32_t number = client->Steer(steering);
    while (!steerings.empty() && steerings.rbegin()->first + 1 < number) {
      steerings.emplace(steerings.rbegin()->first + 1, client::Steering(steerings.rbegin()->second));
    }
    steerings[number] = steering;
  }
  // Until the world has made so many ticks; a failure takes ten seconds of real time.
  void Until(std::uint64_t ticks) {
    const auto limit = std::chrono::steady_clock::now() + std::chrono::seconds(10);
    std::chrono::steady_clock::time_point now{std::chrono::hours(1)};
    while (world->tick().value() < ticks) {
      ASSERT_LT(std::chrono::steady_clock::now(), limit) << world->tick().value();
      now += kQuarterTick;
      const std::uint64_t before = world->tick().value();
      ASSERT_TRUE(world->Advance(now).ok());
      const std::uint64_t tick = world->tick().value();
      if (!moments.empty()) {
        ASSERT_LE(tick, before + 1) << "each tick with the car is seen";
      }
      if (tick > before && world->region().Owns(PlayerBodyId(kDriver))) moments[tick] = MomentOf(world->region());
      Steer(SteeringAt(tick));
      (void)client->Poll(now);
    }
  }
};

// The region that a worker builds of the native game and the same scene, with the inputs of the drive.
class WorkersRegion {
 public:
  explicit WorkersRegion(const std::shared_ptr<const Scene>& scene) {
    const auto car = game::NativeModule::Load(TESSERA_BINARY_DIR "/game_modules", "car");
    EXPECT_TRUE(car.ok()) << car.status();
    auto host = game::GameHost::Load((*car)->module(), {"car", ""}, scene);
    EXPECT_TRUE(host.ok()) << host.status();
    region::Config config{RegionId(1), Incarnation(1), scene, *MakeGridMap(scene->ground(), 1), {}, nullptr};
    config.game = *std::move(host);
    region_ = std::make_unique<region::Region>(std::move(config));
    (void)region_->Start();
  }
  region::Region& operator*() { return *region_; }
  region::Region* operator->() { return region_.get(); }

 private:
  std::unique_ptr<region::Region> region_;
};

PlayerInput InputOf(std::uint32_t number, const client::Steering& steering) {
  PlayerInput input;
  input.number = number;
  input.player = kDriver;
  input.body = PlayerBodyId(kDriver);
  input.move = steering.move;
  input.buttons = steering.buttons;
  return AsSent(input);
}

TEST(LocalMovementTest, TheCarOfAGameInLuaMovesAsAWorkersDoesToTheBit) {
  Drive drive;
  ASSERT_NO_FATAL_FAILURE(drive.Begin("function on_tick() if world.tick() == 5 then print('five') end end"));
  ASSERT_NO_FATAL_FAILURE(drive.Until(900));
  const auto scene = LoadScene(SceneForm::kText, CarScene(), "car");
  ASSERT_TRUE(scene.ok()) << scene.status();
  WorkersRegion worker(scene->scene);
  std::map<std::uint64_t, std::uint32_t> acted;  // the inputs by the tick in which they did
  std::uint32_t last = 0;
  for (const auto& [tick, moment] : drive.moments) {
    if (moment.input != last) acted[tick] = last = moment.input;
  }
  ASSERT_FALSE(drive.moments.empty());
  const std::uint64_t begun = drive.moments.begin()->first;
  int compared = 0;
  while (worker->tick() < Tick(900)) {
    const std::uint64_t next = worker->tick().value() + 1;
    if (next == begun) worker->SpawnPlayer(kDriver);
    // It is chosen in the step before the one in which it acts.
    if (const auto due = acted.find(next + 1); due != acted.end()) {
      ASSERT_TRUE(drive.steerings.contains(due->second)) << due->second;
      const absl::Status queued = worker->QueueInput(InputOf(due->second, drive.steerings.at(due->second)));
      ASSERT_TRUE(queued.ok()) << queued << " at tick " << next;
    }
    ASSERT_TRUE(worker->CanStep());
    (void)worker->Step();
    const auto moment = drive.moments.find(next);
    if (moment == drive.moments.end()) continue;
    ++compared;
    const Moment workers = MomentOf(*worker);
    ASSERT_EQ(workers.input, moment->second.input) << "tick " << next;
    ASSERT_EQ(workers.body, moment->second.body) << "tick " << next;
    ASSERT_EQ(workers.memory, moment->second.memory) << "tick " << next;
  }
  EXPECT_GT(compared, 800);
  EXPECT_GT(acted.size(), 700U) << "it is driven by its own inputs";
  const BodyState end = drive.moments.rbegin()->second.body;
  EXPECT_GT(std::hypot(end.position.x + 3, end.position.z), 5) << "it has driven";
  EXPECT_NE(drive.moments.rbegin()->second.memory, MovementState());
}

}  // namespace
}  // namespace tessera::local
