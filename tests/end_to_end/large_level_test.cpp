// A level of two million triangles through a cluster of real processes: sent before its world is made, run by two
// workers, and loaded by a client tile by tile.
#include <gmock/gmock.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "client_sdk/client.h"
#include "core/world/level_tiles.h"
#include "host/files.h"
#include "host/temporary_folder.h"
#include "tessera/v1/scene.pb.h"
#include "tests/end_to_end/world_fixture.h"

namespace tessera::end_to_end {
namespace {

using ::testing::HasSubstr;

constexpr std::uint32_t kQuarterCells = 500;  // squares a side of one of the four meshes, of a metre each
constexpr std::size_t kTriangles = std::size_t{4} * 2 * kQuarterCells * kQuarterCells;
constexpr double kHillHeight_m = 3;
constexpr double kViewRadius_m = 60;
constexpr std::chrono::seconds kCreatePatience{600};  // a sanitizer reads the level ten times as slowly

double GroundAt(double x, double z) { return kHillHeight_m * std::sin(x / 40) * std::cos(z / 50); }

// Ground of 500 m from its corner on.
void AddQuarter(v1::Scene& scene, std::uint64_t id, double corner_x, double corner_z) {
  v1::Body& ground = *scene.add_bodies();
  ground.set_id(id);
  ground.set_motion(v1::MOTION_STATIC);
  auto& mesh = *ground.mutable_shape()->mutable_mesh();
  for (std::uint32_t row = 0; row <= kQuarterCells; ++row) {
    for (std::uint32_t column = 0; column <= kQuarterCells; ++column) {
      v1::Vec3& vertex = *mesh.add_vertices();
      vertex.set_x(corner_x + column);
      vertex.set_z(corner_z + row);
      vertex.set_y(GroundAt(vertex.x(), vertex.z()));
    }
  }
  for (std::uint32_t row = 0; row < kQuarterCells; ++row) {
    for (std::uint32_t column = 0; column < kQuarterCells; ++column) {
      const std::uint32_t at = row * (kQuarterCells + 1) + column, below = at + kQuarterCells + 1;
      for (const std::uint32_t index : {at, below, at + 1, at + 1, below, below + 1}) mesh.add_indices(index);
    }
  }
}

v1::Scene SquareKilometre() {
  v1::Scene scene;
  scene.set_name("kilometre");
  for (const double sign : {-1.0, 1.0}) {
    v1::Vec3& corner = sign < 0 ? *scene.mutable_bounds()->mutable_min() : *scene.mutable_bounds()->mutable_max();
    corner.set_x(sign * 500);
    corner.set_y(sign < 0 ? -20 : 100);
    corner.set_z(sign * 500);
  }
  AddQuarter(scene, 1, -500, -500);
  AddQuarter(scene, 2, 0, -500);
  AddQuarter(scene, 3, -500, 0);
  AddQuarter(scene, 4, 0, 0);
  // Balls that roll about the middle, on both sides of the border.
  for (std::uint64_t id = 10; id < 30; ++id) {
    v1::Body& ball = *scene.add_bodies();
    ball.set_id(id);
    ball.set_mass(1);
    ball.mutable_shape()->mutable_sphere()->set_radius(0.5);
    v1::Vec3& position = *ball.mutable_pose()->mutable_position();
    position.set_x(3.0 * static_cast<double>(id) - 60);
    position.set_y(8);
  }
  return scene;
}

class LargeLevelTest : public WorldTest {
 protected:
  std::string File(const std::string& name) const { return folder_.path() + "/" + name; }
  const host::TemporaryFolder folder_;
};

TEST_F(LargeLevelTest, OfTwoMillionTrianglesRunsAndComesToAClientByItsTiles) {
  const v1::Scene scene = SquareKilometre();
  ASSERT_EQ(kTriangles, 2'000'000u);
  ASSERT_GT(scene.ByteSizeLong(), std::size_t{16} << 20) << "too large for a request";
  ASSERT_TRUE(host::WriteFile(File("level.pb"), scene.SerializeAsString(), host::Durability::kSurvivesProcess).ok());

  Start({.scene = support::ScenePath("course"),
         .regions = 1,
         .bodies = std::nullopt,
         .bots = 0,
         .capacity = 8,
         .control_arguments = {"--start-timeout", std::to_string(kCreatePatience.count())}});
  const std::vector<std::string> create{"instance",  "create", "--scene",   File("level.pb"),
                                        "--regions", "2",      "--timeout", std::to_string(kCreatePatience.count()),
                                        "--wait"};
  const auto created = Tessera(create, kCreatePatience);
  ASSERT_EQ(created.exit_code, 0) << created.err;
  EXPECT_THAT(created.err, HasSubstr("sent before the request"));

  // By a grant: all that it knows of the level the regions send it.
  const client::JoinOptions viewer{.control_address = run_->cluster().control_address(),
                                   .instance_id = "inst-2",
                                   .player_name = "",
                                   .deadline = std::chrono::seconds(60),
                                   .watch = true};
  const auto grant = client::Client::GetGrant(viewer);
  ASSERT_TRUE(grant.ok()) << grant.status();
  const auto joined = client::Client::JoinByGrant(*grant, {.deadline = std::chrono::seconds(60)});
  ASSERT_TRUE(joined.ok()) << joined.status();
  client::Client& onlooker = **joined;
  onlooker.ViewTiles(Vec3d{0, 0, 0}, kViewRadius_m);
  const auto now = [] { return std::chrono::steady_clock::now(); };
  const auto reached = [&] {
    std::vector<std::uint32_t> tiles;
    const LevelIndex* index = onlooker.Tiles();
    for (std::uint32_t tile = 0; index != nullptr && tile < index->tiles.size(); ++tile) {
      const Aabb& bounds = index->tiles[tile].bounds;
      const double x = std::clamp(0.0, bounds.min.x, bounds.max.x), z = std::clamp(0.0, bounds.min.z, bounds.max.z);
      if (std::hypot(x, z) < kViewRadius_m) tiles.push_back(tile);
    }
    return tiles;
  };
  const auto all_here = [&] {
    const std::vector<std::uint32_t> tiles = reached();
    return !tiles.empty() &&
           std::ranges::all_of(tiles, [&](std::uint32_t tile) { return onlooker.TileAt(tile) != nullptr; });
  };
  Tick first{};
  const auto moves_on_ground = [&] {
    if (onlooker.state() != client::ClientState::kPlaying || onlooker.World().size() < 20) return false;
    if (first == Tick()) first = onlooker.tick();
    return onlooker.tick().value() > first.value() + 300;
  };
  ASSERT_TRUE(PlayUntil("the tiles about the middle, and five seconds of the world",
                        [&] {
                          onlooker.Poll(now());
                          return all_here() && moves_on_ground();
                        }))
      << onlooker.reason() << ", " << reached().size() << " tiles reached";
  EXPECT_LT(reached().size(), onlooker.Tiles()->tiles.size()) << "it was asked for a part of it";
  for (const auto& [id, body] : onlooker.World()) {
    const Vec3d& at = body.state.position;
    EXPECT_NEAR(at.y, GroundAt(at.x, at.z) + 0.5, 0.2) << "body " << id.value() << " lies on the ground";
  }

  // Another world of it costs no further sending: it waits there still.
  EXPECT_TRUE(onlooker.Leave().ok());
  EXPECT_EQ(Tessera({"instance", "delete", "inst-2"}).exit_code, 0);
  const auto again = Tessera(create, kCreatePatience);
  ASSERT_EQ(again.exit_code, 0) << again.err;
  EXPECT_EQ(again.err.find("sent before the request"), std::string::npos) << again.err;
}

}  // namespace
}  // namespace tessera::end_to_end
