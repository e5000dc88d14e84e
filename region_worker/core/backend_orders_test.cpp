#include "region_worker/core/backend_orders.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/game/game_host.h"
#include "core/game/testing/scripted_game.h"
#include "game_sdk/api/api.h"
#include "region_worker/core/report.h"
#include "region_worker/testing/core_rig.h"

namespace tessera::worker {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

class BackendOrdersTest : public ::testing::Test {
 protected:
  BackendOrdersTest() {
    auto scene = std::make_shared<Scene>(*SmallWorld());
    scene->kinds = {"", "crate"};
    for (BodyDef& body : scene->bodies) body.kind = 1;
    game_.On(game::kOnBodyMessage, "crate", [this](game::GameCalls&, game::ScriptedGame::Arguments arguments) {
      got.emplace_back(arguments[1].as.text, arguments[1].count);
      return true;
    });
    module_ = game_.module();
    region::Config config = ConfigOf(1, 1, scene);
    config.game = *game::GameHost::Load(module_, {"game.lua", ""}, scene);
    region = std::make_unique<region::Region>(std::move(config));
    region->Start();
  }
  void Step() {
    orders.Apply(*region);
    region->Step();
  }
  static BackendOrder Gift(std::uint64_t number, std::uint64_t body, std::string name) {
    BackendOrder order{number, BodyId(body), {}};
    order.message.name = std::move(name);
    return order;
  }

  std::vector<std::string> got;
  std::unique_ptr<region::Region> region;
  BackendOrders orders;

 private:
  game::ScriptedGame game_;
  tessera_game_module module_{};
};

TEST_F(BackendOrdersTest, AMessageIsAnsweredAfterTheStepAndComesOnceHoweverOftenItIsOrdered) {
  const std::vector<BackendOrder> both{Gift(4, 1, "a"), Gift(7, 1, "b")};
  orders.Set({both, 0});
  EXPECT_THAT(orders.Answers(*region), IsEmpty());
  Step();
  EXPECT_THAT(orders.Answers(*region), ElementsAre(BackendAnswer{4}, BackendAnswer{7}));
  BackendOrders again;  // as of a region that promotes the record
  again.Set({both, 0});
  again.Apply(*region);
  region->Step();
  EXPECT_THAT(again.Answers(*region), ElementsAre(BackendAnswer{4}, BackendAnswer{7}));
  EXPECT_THAT(got, ElementsAre("a", "b"));
}

TEST_F(BackendOrdersTest, WithAStandbyItIsAnsweredOnceTheStandbyHasIt) {
  region->SetStandby(true);
  orders.Set({{Gift(1, 1, "a")}, 0});
  Step();
  EXPECT_THAT(orders.Answers(*region), IsEmpty());
  region->LogAcknowledged(region->tick());
  EXPECT_THAT(orders.Answers(*region), ElementsAre(BackendAnswer{1}));
}

TEST_F(BackendOrdersTest, OneForABodyThatIsElsewhereWaits) {
  orders.Set({{Gift(1, 77, "a"), Gift(2, 1, "b")}, 0});
  Step();
  EXPECT_THAT(orders.Answers(*region), ElementsAre(BackendAnswer{2}));
}

TEST_F(BackendOrdersTest, InAWorldWithoutAGameItIsRefused) {
  CoreRig rig;
  orders.Set({{Gift(1, 1, "a")}, 0});
  orders.Apply(rig.region);
  EXPECT_THAT(orders.Answers(rig.region), ElementsAre(BackendAnswer{1, "the world runs no game"}));
}

TEST(ReportGateTest, NewEventsForTheBackendHastenAReport) {
  ReportGate gate;
  const ReportedState state{};
  const TimePoint now{std::chrono::hours(1)};
  gate.Sent(now, state, 3);
  EXPECT_FALSE(gate.Due(now + ReportGate::kEventInterval, state, 3));
  EXPECT_FALSE(gate.Due(now + ReportGate::kEventInterval / 2, state, 4));
  EXPECT_TRUE(gate.Due(now + ReportGate::kEventInterval, state, 4));
  EXPECT_TRUE(gate.Due(now + ReportGate::kInterval, state, 3));
}

}  // namespace
}  // namespace tessera::worker
