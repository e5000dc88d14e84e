// A game and its backend in two regions: events come to the world's record and wait there, messages go where their
// targets are.
#include <gmock/gmock.h>

#include "core/game/game_host.h"
#include "core/game/testing/scripted_game.h"
#include "core/region/region.h"
#include "core/region/testing/small_world.h"
#include "game_sdk/api/api.h"

namespace tessera::region {
namespace {

using game::GameCalls;
using game::GameHost;
using game::ScriptedGame;
using Arguments = ScriptedGame::Arguments;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr BodyId kLeft{1}, kRight{2};

class RegionBackendTest : public ::testing::Test {
 protected:
  RegionBackendTest() {
    Scene scene = Balls({{-5, 0, -5}, {5, 0, 5}});
    scene.kinds = {"", "ball"};
    for (BodyDef& body : scene.bodies) body.kind = 1;
    scene_ = std::make_shared<const Scene>(std::move(scene));
    game.On(game::kOnBodyMessage, "ball", [this](GameCalls&, Arguments arguments) {
      EXPECT_EQ(arguments[3].type, TESSERA_GAME_TEXT);
      got.emplace_back(arguments[1].as.text, arguments[1].count);
      return true;
    });
    game.On(game::kOnBodyTick, "ball", [this](GameCalls& calls, Arguments arguments) {
      if (BodyId(arguments[0].as.id) != publisher || publishes == 0) return true;
      --publishes;
      EXPECT_TRUE(calls.Call(game::kWorldPublish, {"event " + std::to_string(++published)})) << calls.error();
      return true;
    });
    module_ = game.module();
    one = Make(kOne);
    two = Make(kTwo);
    Send(kOne, one->Start());
    Send(kTwo, two->Start());
  }
  void Steps(int count) {
    for (int i = 0; i < count; ++i) {
      ASSERT_TRUE(one->CanStep() && two->CanStep());
      const StepResult first = one->Step(), second = two->Step();
      Send(kOne, first.frames);
      Send(kTwo, second.frames);
    }
  }
  Region& home() { return one->records().Find(kInstanceBody) != nullptr ? *one : *two; }
  static std::vector<std::string> NamesIn(const Region& region) {
    std::vector<std::string> names;
    for (const auto& event : region.published()) names.push_back(event->name);
    return names;
  }
  static game::Message Named(std::string name) {
    game::Message message;
    message.name = std::move(name);
    return message;
  }

  ScriptedGame game;
  std::unique_ptr<Region> one, two;
  BodyId publisher;
  int publishes = 0, published = 0;
  std::vector<std::string> got;

 private:
  std::unique_ptr<Region> Make(RegionId self) {
    Config config{self, Incarnation(1), scene_, *MakeGridMap(scene_->ground(), 2), {}};
    auto host = GameHost::Load(module_, {"game.lua", "fine"}, scene_);
    EXPECT_TRUE(host.ok()) << host.status();
    config.game = *std::move(host);
    return std::make_unique<Region>(std::move(config));
  }
  void Send(RegionId from, const std::vector<OutgoingFrame>& frames) {
    for (const OutgoingFrame& frame : frames) {
      const absl::Status status = (from == kOne ? two : one)->Receive(from, frame.bytes);
      EXPECT_TRUE(status.ok()) << status;
    }
  }

  std::shared_ptr<const Scene> scene_;
  tessera_game_module module_{};
};

TEST_F(RegionBackendTest, EventsOfBothRegionsWaitInOrderWhereTheWorldsRecordIs) {
  for (const BodyId body : {kLeft, kRight}) {
    publisher = body;
    publishes = 3;
    Steps(3);
  }
  Steps(10);
  EXPECT_THAT(NamesIn(home()), ElementsAre("event 1", "event 2", "event 3", "event 4", "event 5", "event 6"));
  EXPECT_THAT(NamesIn(&home() == one.get() ? *two : *one), IsEmpty());
  one->AcknowledgePublished(4);
  two->AcknowledgePublished(4);
  Steps(1);
  EXPECT_THAT(NamesIn(home()), ElementsAre("event 5", "event 6"));
  EXPECT_EQ(home().published().front()->number, 5U);
}

TEST_F(RegionBackendTest, AnEventIsShownOnceTheStandbyHasIt) {
  publisher = kLeft;
  publishes = 1;
  Steps(8);
  ASSERT_THAT(NamesIn(home()), ElementsAre("event 1"));
  home().SetStandby(true);
  publishes = 1;
  Steps(8);
  EXPECT_THAT(NamesIn(home()), IsEmpty()) << "not even the first, as the standby has nothing yet";
  home().LogAcknowledged(home().tick());
  EXPECT_THAT(NamesIn(home()), ElementsAre("event 1", "event 2"));
}

TEST_F(RegionBackendTest, TheOwnerTakesAMessageOnceAndInOrder) {
  Steps(1);
  EXPECT_EQ(two->TakeFromBackend(kLeft, 1, Named("a")).code(), absl::StatusCode::kNotFound);
  EXPECT_TRUE(one->TakeFromBackend(kLeft, 1, Named("a")).ok());
  EXPECT_EQ(one->TakeFromBackend(kLeft, 1, Named("a")).code(), absl::StatusCode::kAlreadyExists);
  EXPECT_TRUE(one->TakeFromBackend(kLeft, 4, Named("b")).ok());
  EXPECT_TRUE(two->TakeFromBackend(kRight, 2, Named("c")).ok()) << "each target has its own numbers";
  Steps(2);
  EXPECT_THAT(got, ElementsAre("a", "b", "c"));
  EXPECT_EQ(one->TakeFromBackend(kLeft, 4, Named("b")).code(), absl::StatusCode::kAlreadyExists);
  Steps(2);
  EXPECT_EQ(got.size(), 3U);
}

TEST_F(RegionBackendTest, ATargetThatIsFullTakesItLater) {
  Steps(1);
  for (std::uint64_t i = 1; i <= game::kMaxInbox; ++i) ASSERT_TRUE(one->TakeFromBackend(kLeft, i, Named("a")).ok());
  EXPECT_EQ(one->TakeFromBackend(kLeft, 5000, Named("b")).code(), absl::StatusCode::kResourceExhausted);
  Steps(1);
  EXPECT_TRUE(one->TakeFromBackend(kLeft, 5000, Named("b")).ok());
}

}  // namespace
}  // namespace tessera::region
