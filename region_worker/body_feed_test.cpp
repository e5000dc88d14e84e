// Clients are told less than the region knows while its standby is behind.
#include "region_worker/body_feed.h"

#include <gmock/gmock.h>

#include <map>
#include <set>

#include "core/replication/snapshot_receiver.h"
#include "core/replication/snapshot_sender.h"

namespace tessera::worker {
namespace {

using ::testing::ElementsAre;

constexpr BodyId kStone{7};
constexpr PlayerNumber kGuest{1};

std::shared_ptr<const Scene> StoneAndGuest() {
  auto scene = std::make_shared<Scene>();
  scene->bounds = {{-50, -50, -50}, {50, 50, 50}};
  scene->gravity_m_s2 = {};
  scene->properties = {{"health", std::int64_t{100}},
                       {"ammunition", std::int64_t{0}, Visibility::kPlayer},
                       {"suspicion", std::int64_t{0}, Visibility::kServers},
                       {"team", std::string()},
                       {"plan", std::int64_t{0}, Visibility::kTeam}};
  scene->team_property = "team";
  BodyDef& def = scene->bodies.emplace_back();
  def.id = kStone;
  def.shape = std::make_shared<const Shape>(Shape{SphereShape{0.5}});
  PlayerRules& player = scene->player.emplace();
  player.body.shape = def.shape;
  player.spawn_points = {{5, 0, 0}};
  player.max_speed_m_s = 1;
  return scene;
}

// A region whose standby has acknowledged what the test says, and one client that gets all snapshots.
class BodyFeedTest : public ::testing::Test {
 protected:
  BodyFeedTest() {
    region_.Start();
    region_.SpawnPlayer(kGuest);
    region_.SetStandby(true);
  }

  // Steps, and tells the client.
  void Tick() {
    const region::StepResult result = region_.Step();
    feed_.Note(result.tick, result.departures);
    feed_.Push(region_, history_);
    for (const replication::Bytes& datagram :
         sender_.Write(history_, {.own = viewer_, .team = feed_.TeamOf(viewer_)}, 0, 0).datagrams) {
      const auto read = receiver_.Read(datagram);
      ASSERT_TRUE(read.ok()) << read.status();
      for (const replication::BodyRecord& body : read->bodies) {
        seen_.insert(body.id);
        if (body.properties != nullptr) told_[body.id] = *body.properties;
      }
      for (const replication::DepartureRecord& departure : read->departures) seen_.erase(departure.id);
    }
    ASSERT_TRUE(sender_.Acknowledge(receiver_.WriteAck()).ok());
  }
  void TickWithStandby() {
    Tick();
    region_.LogAcknowledged(region_.tick());
  }
  PropertyValue Told(BodyId id, std::string_view name) {
    const PropertySet told = PropertySet::Decode(told_[id], scene_->properties).value();
    return *ValueOf(scene_->properties, {}, told, name);
  }
  PropertyValue Health(BodyId id) { return Told(id, "health"); }

  const std::shared_ptr<const Scene> scene_ = StoneAndGuest();
  region::Region region_{{.self = RegionId(1),
                          .incarnation = Incarnation(1),
                          .scene = scene_,
                          .map = *MakeGridMap(scene_->ground(), 1),
                          .settings = {}}};
  BodyFeed feed_;
  replication::SnapshotHistory history_{scene_->bounds, {}};
  replication::SnapshotSender sender_{{}};
  replication::SnapshotReceiver receiver_{scene_->bounds, {}};
  BodyId viewer_;  // the client's own body
  std::set<BodyId> seen_;
  std::map<BodyId, std::vector<std::uint8_t>> told_;
};

TEST_F(BodyFeedTest, APropertyIsToldWhenTheStandbyHasIt) {
  TickWithStandby();
  ASSERT_TRUE(region_.SetProperty(kStone, "health", std::int64_t{80}, 1).ok());
  Tick();
  Tick();
  EXPECT_EQ(Health(kStone), PropertyValue(std::int64_t{100}));
  region_.LogAcknowledged(region_.tick());
  Tick();
  EXPECT_EQ(Health(kStone), PropertyValue(std::int64_t{80}));
}

TEST_F(BodyFeedTest, ARemovalIsToldWhenTheStandbyHasIt) {
  TickWithStandby();
  EXPECT_THAT(seen_, ElementsAre(kStone, PlayerBodyId(kGuest)));
  region_.RemovePlayer(kGuest);
  Tick();
  Tick();
  ASSERT_FALSE(region_.Owns(PlayerBodyId(kGuest)));
  EXPECT_THAT(seen_, ElementsAre(kStone, PlayerBodyId(kGuest)));
  region_.LogAcknowledged(region_.tick());
  Tick();
  EXPECT_THAT(seen_, ElementsAre(kStone));
}

TEST_F(BodyFeedTest, WithoutAStandbyAllIsToldAtOnce) {
  region_.SetStandby(false);
  ASSERT_TRUE(region_.SetProperty(kStone, "health", std::int64_t{80}, 1).ok());
  Tick();
  EXPECT_EQ(Health(kStone), PropertyValue(std::int64_t{80}));
  region_.RemovePlayer(kGuest);
  Tick();
  EXPECT_THAT(seen_, ElementsAre(kStone));
}

TEST_F(BodyFeedTest, APlayerAloneSeesWhatIsForThePlayerAndNobodyWhatIsForServers) {
  const BodyId guest = PlayerBodyId(kGuest);
  region_.SetStandby(false);
  const auto set = [&](BodyId body, const char* name, std::uint64_t change) {
    ASSERT_TRUE(region_.SetProperty(body, name, std::int64_t{3}, change).ok());
  };
  Tick();
  set(guest, "ammunition", 1);
  set(guest, "suspicion", 2);
  set(kStone, "ammunition", 3);
  Tick();
  Tick();
  EXPECT_EQ(Told(guest, "ammunition"), PropertyValue(std::int64_t{0})) << "another player looks";
  EXPECT_EQ(Told(guest, "suspicion"), PropertyValue(std::int64_t{0}));
  viewer_ = guest;
  sender_ = replication::SnapshotSender{{}};  // the guest itself joins
  receiver_ = replication::SnapshotReceiver(scene_->bounds, {});
  set(guest, "health", 4);
  Tick();
  EXPECT_EQ(Told(guest, "health"), PropertyValue(std::int64_t{3}));
  EXPECT_EQ(Told(guest, "ammunition"), PropertyValue(std::int64_t{3}));
  EXPECT_EQ(Told(guest, "suspicion"), PropertyValue(std::int64_t{0}));
  EXPECT_EQ(Told(kStone, "ammunition"), PropertyValue(std::int64_t{0})) << "a stone is no player's";
}

TEST_F(BodyFeedTest, ATeamIsThatOfThePropertyAndSeesWhatItsBodiesTellIt) {
  const BodyId guest = PlayerBodyId(kGuest);
  region_.SetStandby(false);
  viewer_ = guest;
  Tick();
  ASSERT_TRUE(region_.SetProperty(kStone, "plan", std::int64_t{3}, 1).ok());
  ASSERT_TRUE(region_.SetProperty(kStone, "team", std::string("red"), 2).ok());
  ASSERT_TRUE(region_.SetProperty(guest, "team", std::string("blue"), 3).ok());
  Tick();
  Tick();
  EXPECT_EQ(Told(kStone, "team"), PropertyValue(std::string("red")));
  EXPECT_EQ(Told(kStone, "plan"), PropertyValue(std::int64_t{0})) << "of another team";
  ASSERT_TRUE(region_.SetProperty(guest, "team", std::string("red"), 4).ok());
  Tick();
  Tick();
  EXPECT_EQ(Told(kStone, "plan"), PropertyValue(std::int64_t{3}));
  EXPECT_EQ(feed_.TeamOf(guest), feed_.TeamOf(kStone));
}

}  // namespace
}  // namespace tessera::worker
