// Questions to all regions, by rays, sweeps and overlaps, now and back in time: four regions answer as one does, and
// whoever dies, each question has one answer.
#include <gmock/gmock.h>

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "game_sdk/lua/lua_module.h"
#include "game_sdk/testing/lockstep_world.h"

namespace tessera::game {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::SizeIs;

constexpr BodyId kAskerBody{1};

// Sixteen balls that fly to and fro over the borders, each in a lane of its own, and one who asks, in a corner.
std::shared_ptr<const Scene> Lanes() {
  auto scene = std::make_shared<Scene>();
  scene->bounds = {{-20, -20, -20}, {20, 20, 20}};
  scene->gravity_m_s2 = {};
  scene->kinds = {"", "asker", "ball", "door"};
  scene->properties = {{"team", std::int64_t{0}}};
  const auto add = [&](std::uint16_t kind, Vec3d position, Vec3f velocity) -> BodyDef& {
    BodyDef& def = scene->bodies.emplace_back();
    def.id = BodyId(scene->bodies.size());
    def.kind = kind;
    def.shape = std::make_shared<const Shape>(Shape{SphereShape{0.5}});
    def.initial.position = position;
    def.initial.linear_velocity = velocity;
    def.may_sleep = false;
    return def;
  };
  add(1, {-19, 0, -19}, {});
  for (int lane = 0; lane < 16; ++lane) {
    const float speed = lane % 2 == 0 ? 9.0F : -9.0F;
    add(2, {lane % 2 == 0 ? -4.0 - 0.3 * lane : 4.0 + 0.3 * lane, 0, -16 + 2.0 * lane}, {speed, 0, 0});
  }
  BodyDef& door = add(3, {0, 0, 18}, {});
  door.motion = Motion::kStatic;
  door.mass_kg = 0;
  return scene;
}

constexpr char kAsking[] = R"(
  -- Lines are short, so sums stand for the hits; each place has its own weight.
  local function say(name, hits, complete, values)
    local bodies, fractions, xs, zs = 0, 0, 0, 0
    for i, hit in ipairs(hits) do
      local point = hit.point or vec(0, 0, 0)
      bodies = bodies + i * tonumber(string.sub(tostring(hit.body), 6))
      fractions, xs, zs = fractions + i * (hit.fraction or 0), xs + i * point.x, zs + i * point.z
    end
    print(name, complete, values.asked, #hits, "hits", bodies, string.format("%.12f %.12f %.12f", fractions, xs, zs))
  end
  kinds.asker = {
    on_tick = function(self)
      local tick = world.tick()
      if tick % 30 ~= 0 or tick > 60 then return end
      local asked = { asked = tick }
      local far, near = vec(0, 0, 20), vec(0, 0, -20)
      world.ask_ray("ray", near, far, { limit = 16 }, asked)
      world.ask_ray("ray then", near, far, { at_time = tick - 12.5 }, asked)
      world.ask_sweep("sweep", { radius = 2 }, near, far, { limit = 16, kinds = "ball" }, asked)
      world.ask_sweep("sweep then", { half_extents = vec(1, 1, 1) }, near, far, { limit = 16, at_time = tick - 20 },
                      asked)
      world.ask_overlap("overlap", { radius = 9 }, vec(1, 0, 1), {}, asked)
      world.ask_overlap("overlap then", { half_extents = vec(6, 1, 6) }, vec(0, 0, 0), { at_time = tick - 23.25 },
                        asked)
    end,
    on_answer = function(self, name, hits, complete, values) say(name, hits, complete, values) end,
  }
)";
constexpr std::size_t kQuestions = 12;

class QuestionsTest : public ::testing::Test {
 protected:
  void Begin(std::uint32_t regions) {
    auto created =
        LockstepWorld::Create(*LuaGameModule(), {"game.lua", kAsking}, Lanes(), {.regions = regions, .settings = {}});
    ASSERT_TRUE(created.ok()) << created.status();
    world = *std::move(created);
  }
  void Steps(int count) {
    for (int i = 0; i < count; ++i) {
      const absl::Status status = world->Step();
      ASSERT_TRUE(status.ok()) << status << " in step " << i;
      for (const GameLine& line : world->TakeLines()) {
        EXPECT_FALSE(line.error) << line.text;
        lines.push_back(line.text);
      }
    }
  }

  std::unique_ptr<LockstepWorld> world;
  std::vector<std::string> lines;
};

TEST_F(QuestionsTest, FourRegionsAnswerAsOneDoesNowAndBackInTime) {
  Begin(1);
  Steps(100);
  std::ranges::sort(lines);
  const std::vector<std::string> alone = std::exchange(lines, {});
  ASSERT_THAT(alone, SizeIs(kQuestions));
  for (const std::string& line : alone) {
    EXPECT_THAT(line, HasSubstr(" true ")) << "it is complete";
    EXPECT_THAT(line, Not(HasSubstr(" 0 hits"))) << "it meets something";
  }
  Begin(4);
  ASSERT_NE(world->OwnerOf(BodyId(3)), world->OwnerOf(kAskerBody));
  Steps(100);
  EXPECT_GT(world->handovers(), 8U) << "what is met has gone from one region to another";
  std::ranges::sort(lines);
  EXPECT_EQ(lines, alone);
}

// A region dies in each of the ticks while its answers are under way.
TEST_F(QuestionsTest, EachQuestionHasOneAnswerWhicheverRegionDies) {
  int incomplete = 0;
  for (int after = 0; after < 10; ++after) {
    for (const bool asker : {false, true}) {
      SCOPED_TRACE(testing::Message() << after << (asker ? ", the asker's region" : ", another"));
      lines.clear();
      Begin(4);
      Steps(30 + after);
      const RegionId own = world->OwnerOf(kAskerBody);
      RegionId victim = own;
      for (std::uint64_t ball = 2; !asker && victim == own; ++ball) victim = world->OwnerOf(BodyId(ball));
      ASSERT_TRUE(world->Kill(victim).ok());
      Steps(150);
      EXPECT_THAT(lines, SizeIs(kQuestions));
      std::ranges::sort(lines);
      for (const char* name : {"overlap", "overlap then", "ray", "ray then", "sweep", "sweep then"}) {
        for (const char* asked : {" 30", " 60"}) {
          const auto answers = std::ranges::count_if(lines, [&](const std::string& line) {
            return line.starts_with(std::string(name) + " true" + asked) ||
                   line.starts_with(std::string(name) + " false" + asked);
          });
          EXPECT_EQ(answers, 1) << name << asked;
        }
      }
      incomplete += static_cast<int>(std::ranges::count_if(
          lines, [](const std::string& line) { return line.find(" false ") != std::string::npos; }));
    }
  }
  EXPECT_GT(incomplete, 0) << "who has taken over does not remember, and says so";
}

}  // namespace
}  // namespace tessera::game
