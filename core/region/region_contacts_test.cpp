// Two bodies that meet where regions meet, while they change regions and regions die: each one's callback is called
// once for the touch and once for its end, whichever region owns it.
#include <gmock/gmock.h>

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/game/game_host.h"
#include "core/game/testing/scripted_game.h"
#include "core/region/region.h"
#include "core/region/standby_copy.h"
#include "core/region/testing/carry_on.h"
#include "core/region/testing/regions_in_step.h"
#include "core/region/testing/small_world.h"
#include "core/world/partition_change.h"
#include "game_sdk/api/api.h"

namespace tessera::region::contacts {
namespace {

using game::GameCalls;
using game::GameHost;
using game::ScriptedGame;
using Arguments = ScriptedGame::Arguments;

constexpr BodyId kLower{1}, kHigher{2};
constexpr std::uint64_t kEnd = 60;

// Two balls fly towards each other along x, meet at `meet` in tick 15, and part again. Each counts in its properties,
// which a death takes back together with what was counted.
class ContactsTest : public RegionsInStep {
 protected:
  void Begin(double meet, bool lower_first) {
    const double way = lower_first ? -2 : 2;
    Scene scene = Balls({{meet + way, 0, 0}, {meet - way, 0, 0}});
    scene.kinds = {"", "ball"};
    scene.properties = {{"met", std::int64_t{0}}, {"parted", std::int64_t{0}}, {"strikes", 0.0}};
    for (BodyDef& def : scene.bodies) {
      def.may_sleep = false;
      def.kind = 1;
      def.material.restitution = bounce;
      def.material.friction = 0;
      const bool to_the_right = def.initial.position.x < meet;
      def.initial.linear_velocity = {to_the_right ? 6.0F : -6.0F, 0, 0};
    }
    scene_ = std::make_shared<const Scene>(std::move(scene));
    map_ = std::make_unique<PartitionMap>(*MakeGridMap(scene_->ground(), 2));
    normals.clear();
    Script();
    module_ = game.module();
    regions_.clear();
    hosts_.clear();
    for (const MapRegion& entry : map_->regions()) regions_[entry.id] = Make(entry.id);
    for (auto& [id, region] : regions_) Send(region->Start(), id);
  }
  void Script() {
    game.On(game::kOnBodyTick, "ball", [this](GameCalls& calls, Arguments arguments) {
      const BodyId self(arguments[0].as.id);
      if (removed_in == 0 || self != kLower || !calls.Call(game::kWorldTick, {})) return true;
      return calls.result().as.whole != static_cast<std::int64_t>(removed_in) || calls.Call(game::kBodyRemove, {self});
    });
    const auto count = [](GameCalls& calls, Arguments arguments, const char* name) {
      const BodyId self(arguments[0].as.id);
      EXPECT_EQ(BodyId(arguments[1].as.id), self == kLower ? kHigher : kLower);
      EXPECT_TRUE(calls.Call(game::kBodyGet, {self, std::string(name)}));
      return calls.Call(game::kBodySet, {self, std::string(name), calls.result().as.whole + 1});
    };
    game.On(game::kOnBodyContact, "ball", [this, count](GameCalls& calls, Arguments arguments) {
      const auto contact = game::FieldsFrom(arguments[2]);
      EXPECT_TRUE(contact.ok() && contact->size() == 3) << arguments[0].as.id;
      if (contact.ok() && contact->size() == 3) {
        EXPECT_NEAR(std::get<double>((*contact)[0].second), 6 * (1 + bounce), 0.5) << "1 kg at 6 m/s";
        normals[BodyId(arguments[0].as.id)] = std::get<Vec3d>((*contact)[1].second).x;
      }
      return count(calls, arguments, "met");
    });
    game.On(game::kOnBodyContactEnded, "ball", [count](GameCalls& calls, Arguments arguments) {
      EXPECT_TRUE(calls.Call(game::kBodyGet, {BodyId(arguments[0].as.id), std::string("met")}));
      EXPECT_EQ(calls.result().as.whole, 1) << "it ends after it has begun";
      return count(calls, arguments, "parted");
    });
  }
  std::unique_ptr<Region> Make(RegionId self) {
    auto host = GameHost::Load(module_, {"game.lua", "fine"}, scene_);
    EXPECT_TRUE(host.ok()) << host.status();
    Config config{self, Incarnation(self.value()), scene_, *map_, {}, nullptr};
    config.game = *std::move(host);
    hosts_.push_back(config.game);
    return std::make_unique<Region>(std::move(config));
  }
  Region& at(RegionId id) { return *regions_.at(id); }
  std::int64_t Count(BodyId body, const char* name) {
    for (const auto& [id, region] : regions_) {
      if (!region->Owns(body)) continue;
      const KeptRecord* const record = region->records().Find(body);
      const PropertySet changed =
          record == nullptr ? PropertySet() : PropertySet::Decode(*record->bytes, scene_->properties).value();
      return std::get<std::int64_t>(*ValueOf(scene_->properties, {}, changed, name));
    }
    return -1;
  }
  void ExpectOnce() {
    for (const BodyId body : {kLower, kHigher}) {
      EXPECT_EQ(Count(body, "met"), 1) << "body " << body.value();
      EXPECT_EQ(Count(body, "parted"), 1) << "body " << body.value();
    }
    EXPECT_NEAR(normals[kLower], -normals[kHigher], 1e-9) << "each from the other one";
    EXPECT_NEAR(std::abs(normals[kLower]), 1, 1e-3);
    ExpectNoFaults();
  }
  void ExpectNoFaults() {
    for (const auto& host : hosts_) {
      for (const game::GameLine& line : host->TakeLines()) ADD_FAILURE() << line.text;
      EXPECT_EQ(host->statistics().dropped_events, 0U);
    }
  }
  std::uint64_t MessagesApplied() const {
    std::uint64_t applied = 0;
    for (const auto& host : hosts_) applied += host->statistics().messages.applied;
    return applied;
  }

  ScriptedGame game;
  double bounce = 1;             // restitution of both
  std::uint64_t removed_in = 0;  // the tick in which the game removes the lower one; 0: it stays
  std::map<BodyId, double> normals;

 private:
  std::shared_ptr<const Scene> scene_;
  std::unique_ptr<PartitionMap> map_;
  std::vector<std::shared_ptr<GameHost>> hosts_;
  tessera_game_module module_{};
};

// The balls meet at many places about the border, so one of them, both or none has been handed over by then, or is on
// its way.
TEST_F(ContactsTest, EachOfTwoIsCalledOnceWhereverTheyMeet) {
  int across = 0;
  for (const bool lower_first : {true, false}) {
    for (double meet = -2.5; meet <= 2.5; meet += 0.125) {
      SCOPED_TRACE(testing::Message() << "at " << meet << ", the lower one " << (lower_first ? "left" : "right"));
      Begin(meet, lower_first);
      ASSERT_NO_FATAL_FAILURE(StepTo(kEnd));
      ExpectOnce();
      across += MessagesApplied() > 0 ? 1 : 0;
    }
  }
  EXPECT_GE(across, 20) << "many of them met across the border";
}

// The lower one is removed while they lie against each other, in a tick before, while or after the touch is told over
// the border: the other one hears that it ended, once, and never before it began.
TEST_F(ContactsTest, WhoTouchesOneThatIsRemovedHearsThatItEnded) {
  int across = 0;
  for (const bool lower_first : {true, false}) {
    for (double meet = -1; meet <= 1; meet += 0.125) {
      for (std::uint64_t gone = 20; gone <= 40; gone += 4) {
        SCOPED_TRACE(testing::Message() << "at " << meet << ", the lower one " << (lower_first ? "left" : "right")
                                        << ", gone in tick " << gone);
        bounce = 0;
        removed_in = gone;
        Begin(meet, lower_first);
        ASSERT_NO_FATAL_FAILURE(StepTo(kEnd));
        EXPECT_EQ(Count(kLower, "met"), -1) << "it is gone";
        EXPECT_EQ(Count(kHigher, "met"), 1);
        EXPECT_EQ(Count(kHigher, "parted"), 1);
        ExpectNoFaults();
        across += MessagesApplied() > 1 ? 1 : 0;
      }
    }
  }
  EXPECT_GE(across, 40) << "many of them met across the border";
}

// One region dies in each of the ticks about the touch, with a standby that is up to two ticks behind. Where that takes
// back the touch and one of the balls, they may pass on without another one: then nobody has heard of any.
TEST_F(ContactsTest, BothOrNeitherAreCalledWhicheverRegionDies) {
  int cases = 0, touched = 0;
  for (const RegionId dead : {kOne, kTwo}) {
    for (const double meet : {-0.6, 0.0, 0.6}) {
      for (std::uint64_t dies = 12; dies <= 26; ++dies) {
        for (std::uint64_t behind = 0; behind <= 2; ++behind) {
          SCOPED_TRACE(testing::Message() << "region " << dead.value() << " dies in tick " << dies << ", " << behind
                                          << " behind, the balls meet at " << meet);
          Begin(meet, dies % 2 == 0);
          at(dead).SetStandby(true);
          StandbyCopy copy(dead, at(dead).catalog());
          while (at(dead).tick().value() < dies) {
            ASSERT_NO_FATAL_FAILURE(Step());
            if (at(dead).tick().value() + behind > dies) continue;
            ASSERT_TRUE(copy.Receive(logs[dead]).ok());
            at(dead).LogAcknowledged(copy.tick());
          }
          const RegionId heir = dead == kOne ? kTwo : kOne;
          const auto resolution = CarryOn(at(heir), dead, copy);
          ASSERT_TRUE(resolution.ok()) << resolution.status();
          regions_.erase(dead);
          ASSERT_NO_FATAL_FAILURE(StepTo(kEnd + 20));
          ASSERT_EQ(at(heir).owned().size(), 2U);
          ++cases;
          if (Count(kLower, "met") > 0) {
            ++touched;
            ExpectOnce();
            continue;
          }
          for (const char* name : {"met", "parted"}) {
            EXPECT_EQ(Count(kLower, name), 0) << name;
            EXPECT_EQ(Count(kHigher, name), 0) << name;
          }
        }
      }
    }
  }
  EXPECT_GE(touched, cases * 9 / 10) << "of " << cases;
}

}  // namespace
}  // namespace tessera::region::contacts
