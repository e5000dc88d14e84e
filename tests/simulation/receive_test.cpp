// Frames off the wire: good ones are taken once, bad ones never, and nothing ends the process.
#include <gmock/gmock.h>

#include <limits>
#include <random>

#include "core/region/frame.h"
#include "tests/simulation/region_group.h"
#include "tests/simulation/scene_builder.h"

namespace tessera::simulation {
namespace {

using ::testing::HasSubstr;

SceneBuilder TwoBalls() {
  SceneBuilder builder(20);
  builder.Add(Ball(0.5), {-0.6, 1, -5}, {1, 0, 0});
  builder.Add(Ball(0.5), {0.6, 1, -5});
  return builder;
}

class ReceiveTest : public ::testing::Test {
 protected:
  ReceiveTest() {
    const std::shared_ptr<const Scene> scene = TwoBalls().Build();
    const PartitionMap map = *MakeGridMap(scene->ground(), 3);
    for (std::uint32_t id : {1, 2, 3}) {
      regions.push_back(std::make_unique<region::Region>(
          region::Config{RegionId(id), Incarnation(1), scene, map, region::RegionSettings()}));
      for (region::OutgoingFrame& frame : regions.back()->Start()) {
        if (frame.to == RegionId(1)) to_first.push_back(frame.bytes);
      }
    }
  }
  std::string Error(std::uint32_t from, std::span<const std::uint8_t> bytes) {
    return std::string(regions[0]->Receive(RegionId(from), bytes).message());
  }

  std::vector<std::unique_ptr<region::Region>> regions;
  std::vector<region::Bytes> to_first;  // frames of tick 0, of regions 2 and 3
};

TEST_F(ReceiveTest, AStepWaitsForEveryNeighbour) {
  EXPECT_FALSE(regions[0]->CanStep());
  EXPECT_THAT(regions[0]->WaitingFor(), ::testing::ElementsAre(RegionId(2), RegionId(3)));
  EXPECT_EQ(Error(2, to_first[0]), "");
  EXPECT_THAT(regions[0]->WaitingFor(), ::testing::ElementsAre(RegionId(3)));
  EXPECT_EQ(Error(3, to_first[1]), "");
  EXPECT_TRUE(regions[0]->CanStep());
}

TEST_F(ReceiveTest, AFrameThatIsHereAlreadyIsIgnored) {
  EXPECT_EQ(Error(2, to_first[0]), "");
  EXPECT_EQ(Error(2, to_first[0]), "");
  EXPECT_EQ(Error(3, to_first[1]), "");
  regions[0]->Step();
  EXPECT_EQ(Error(2, to_first[0]), "");
  EXPECT_THAT(regions[0]->WaitingFor(), ::testing::Contains(RegionId(2)));
}

TEST_F(ReceiveTest, OnlyNeighboursSpeakForThemselves) {
  EXPECT_EQ(Error(9, to_first[0]), "region 9 is not a neighbour");
  EXPECT_EQ(Error(3, to_first[0]), "a frame of region 2 from region 3");
  EXPECT_EQ(Error(2, {}), "header: truncated");
}

TEST_F(ReceiveTest, NobodyShowsOrGrantsWhatIsOwnedHere) {
  region::BorderFrame frame = *region::Decode(to_first[0], {});
  ASSERT_EQ(frame.ghosts.size(), 1U);
  frame.ghosts[0].id = BodyId(1);
  EXPECT_EQ(Error(2, region::Encode(frame, {})), "body 1 is owned here");
  frame.ghosts.clear();
  frame.grants.resize(1);
  frame.grants[0].bodies = {{BodyId(1), Epoch(9), BodyState()}};
  EXPECT_EQ(Error(2, region::Encode(frame, {})), "body 1 is owned here and granted");
  EXPECT_EQ(Error(2, to_first[0]), "");  // the good one is still welcome
}

TEST_F(ReceiveTest, FramesOfAnotherMapOrTooEarlyAreRefused) {
  region::BorderFrame frame = *region::Decode(to_first[0], {});
  frame.map_version = MapVersion(5);
  EXPECT_THAT(Error(2, region::Encode(frame, {})), HasSubstr("map version 5"));
  frame.map_version = MapVersion(1);
  frame.tick = Tick(1);
  frame.stamp.number = 1;
  EXPECT_THAT(Error(2, region::Encode(frame, {})), HasSubstr("tick 1 came before its time"));
}

TEST_F(ReceiveTest, NothingOfABadFrameIsUsedAndTheGoodOneIsStillWelcome) {
  const region::BorderFrame good = *region::Decode(to_first[0], {});
  region::BorderFrame frame = good;
  frame.ghosts[0].id = BodyId(77);
  EXPECT_EQ(Error(2, region::Encode(frame, {})), "body 77 is not a dynamic body of the scene");
  frame = good;
  frame.ghosts[0].state.linear_velocity.x = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(Error(2, region::Encode(frame, {})), HasSubstr("body 2: linear_velocity.x must be a finite number"));
  frame = good;
  frame.ghosts[0].state.position.y = std::numeric_limits<double>::infinity();
  EXPECT_THAT(Error(2, region::Encode(frame, {})), HasSubstr("body 2: position.y must be a finite number"));
  for (std::size_t length = 0; length < to_first[0].size(); ++length) {
    EXPECT_NE(Error(2, std::span(to_first[0]).first(length)), "") << length;
  }
  EXPECT_THAT(regions[0]->WaitingFor(), ::testing::Contains(RegionId(2)));
  EXPECT_EQ(Error(2, to_first[0]), "");
  EXPECT_THAT(regions[0]->WaitingFor(), ::testing::Not(::testing::Contains(RegionId(2))));
}

region::Bytes Mutated(region::Bytes bytes, std::mt19937_64& random) {
  const std::uint64_t kind = random() % 4;
  if (kind == 0) {
    bytes.resize(random() % (bytes.size() + 1));
  } else if (kind == 1) {
    bytes.push_back(static_cast<std::uint8_t>(random()));
  } else {
    const std::uint64_t changes = 1 + random() % 4;
    for (std::uint64_t i = 0; i < changes; ++i) {
      std::uint8_t& byte = bytes[random() % bytes.size()];
      byte = kind == 2 ? static_cast<std::uint8_t>(byte ^ (1U << random() % 8)) : static_cast<std::uint8_t>(random());
    }
  }
  return bytes;
}

// Damaged copies of real frames come before each real one. Most are refused; those that pass are lies, and the region
// lives with them.
TEST(FrameNoiseTest, NothingInAFrameEndsTheProcess) {
  SceneBuilder builder(10);
  builder.Gravity().Floor(0.2);
  for (int i = 0; i < 40; ++i)
    builder.Add(i % 2 == 0 ? Ball(0.4) : Box(0.4), {-4.0 + i % 8, 0.6 + i / 16, -4.0 + i / 8 * 2.0});
  builder.Tie(BodyId(3), BodyId(4), {0.5, 0, 0}, {-0.5, 0, 0});
  builder.scene().fields.push_back(VortexField{{}, 30, 1, 4});
  PlayerRules rules;
  rules.body.shape = Ball(0.5);
  rules.spawn_points = {{1, 3, 1}};
  rules.max_force_n = 10;
  builder.scene().player = rules;
  const std::shared_ptr<const Scene> scene = builder.Build();
  const PartitionMap map = *MakeGridMap(scene->ground(), 4);
  std::uint64_t refused = 0, passed = 0, steps = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    std::mt19937_64 random(seed);
    std::vector<std::unique_ptr<region::Region>> regions;
    std::vector<std::pair<RegionId, region::OutgoingFrame>> wire;
    const auto send = [&](RegionId from, std::vector<region::OutgoingFrame> frames) {
      for (region::OutgoingFrame& frame : frames) wire.emplace_back(from, std::move(frame));
    };
    for (std::uint32_t id = 1; id <= 4; ++id) {
      regions.push_back(std::make_unique<region::Region>(
          region::Config{RegionId(id), Incarnation(1), scene, map, region::RegionSettings()}));
      send(RegionId(id), regions.back()->Start());
    }
    regions[0]->SpawnPlayer(PlayerNumber(1));
    bool moved = true;
    for (int t = 0; t < 60 && moved; ++t) {
      for (auto& [from, frame] : std::exchange(wire, {})) {
        region::Region& to = *regions[frame.to.value() - 1];
        for (std::uint64_t i = random() % 4; i > 0; --i) {
          const bool good = to.Receive(from, Mutated(frame.bytes, random)).ok();
          ++(good ? passed : refused);
        }
        (void)to.Receive(from, frame.bytes);
      }
      moved = false;
      for (const auto& region : regions) {
        if (!region->CanStep()) continue;
        send(region->id(), region->Step().frames);
        moved = true;
        ++steps;
      }
    }
    for (const auto& region : regions) {
      for (const region::OwnedBody& body : region->owned()) EXPECT_TRUE(IsFinite(body.state.position));
    }
  }
  std::printf("damaged frames: %lu refused, %lu passed as lies; %lu steps\n", static_cast<unsigned long>(refused),
              static_cast<unsigned long>(passed), static_cast<unsigned long>(steps));
  EXPECT_GT(refused, 1000U);
  EXPECT_GT(steps, 1000U);
}

}  // namespace
}  // namespace tessera::simulation
