// The parts of the client that need no window: triangles, hands, scripts, options, the profiler's arithmetic.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "input.h"
#include "meshes.h"
#include "options.h"
#include "profile.h"
#include "script.h"
#include "testing_volume.h"

namespace desktop {
namespace {

tessera::ShapeInfo Shape(tessera_shape_kind kind, double a, double b = 0, double c = 0, double d = 0) {
  tessera::ShapeInfo shape = TESSERA_SHAPE_INFO;
  shape.kind = kind;
  shape.dimensions[0] = a, shape.dimensions[1] = b, shape.dimensions[2] = c, shape.dimensions[3] = d;
  return shape;
}

TEST(MeshTest, ClosedShapesHaveTheirVolumes) {
  const double pi = std::acos(-1.0);
  const auto volume = [](const tessera::ShapeInfo& shape) { return VolumeOf(MeshOf(shape, 0)); };
  EXPECT_NEAR(volume(Shape(TESSERA_SHAPE_BOX, 1, 2, 3)), 48, 1e-3);
  // Round ones are drawn with corners, so a little less.
  const auto near = [](double drawn, double exact) { return drawn < exact && drawn > 0.90 * exact; };
  EXPECT_TRUE(near(volume(Shape(TESSERA_SHAPE_SPHERE, 2)), 32 * pi / 3));
  EXPECT_TRUE(near(volume(Shape(TESSERA_SHAPE_CAPSULE, 1, 2)), 4 * pi + 4 * pi / 3));
  EXPECT_TRUE(near(volume(Shape(TESSERA_SHAPE_CYLINDER, 1, 2)), 4 * pi));
  EXPECT_TRUE(near(volume(Shape(TESSERA_SHAPE_CONE, 1, 3)), pi));
}

TEST(MeshTest, NormalsOfRoundShapesLookOutwards) {
  for (const auto kind : {TESSERA_SHAPE_SPHERE, TESSERA_SHAPE_CAPSULE, TESSERA_SHAPE_CYLINDER, TESSERA_SHAPE_CONE}) {
    for (const Vertex& vertex : MeshOf(Shape(kind, 1, 1.5), 0)) {
      EXPECT_NEAR(Length(vertex.normal), 1, 1e-3);
      EXPECT_GE(Dot(vertex.normal, vertex.position), -1e-4F) << kind;
    }
  }
}

TEST(MeshTest, HullLeavesOutWhatIsInside) {
  std::vector<float> points;
  for (const float x : {-1.0F, 1.0F}) {
    for (const float y : {-1.0F, 1.0F}) {
      for (const float z : {-1.0F, 1.0F}) points.insert(points.end(), {x, y, z});
    }
  }
  points.insert(points.end(), {0, 0, 0, 0.5F, 0.9F, 0, 0, 2, 0});
  EXPECT_NEAR(VolumeOf(ConvexHull(points.data(), points.size() / 3)), 8 + 4.0 / 3, 1e-3);
  const std::vector<float> flat = {0, 0, 0, 1, 0, 0, 0, 0, 1, 1, 0, 1};
  EXPECT_TRUE(ConvexHull(flat.data(), 4).empty());
  EXPECT_TRUE(ConvexHull(nullptr, 0).empty());
}

TEST(MeshTest, LevelsAreDrawnAsGiven) {
  const std::vector<float> corners = {0, 0, 0, 1, 0, 0, 0, 0, 1}, heights = {0, 0, 0, 0, 5, 0, 0, 0, 0};
  const std::vector<std::uint32_t> triangles = {0, 2, 1, 0, 1, 99};  // the second has a corner that is not there
  tessera::ShapeInfo mesh = Shape(TESSERA_SHAPE_MESH, 0);
  mesh.vertices = corners.data(), mesh.vertex_count = 3;
  mesh.indices = triangles.data(), mesh.index_count = 6;
  ASSERT_EQ(MeshOf(mesh, 0).size(), 3u);
  EXPECT_NEAR(MeshOf(mesh, 0)[0].normal.y, 1, 1e-6);
  tessera::ShapeInfo field = Shape(TESSERA_SHAPE_HEIGHT_FIELD, 0);
  field.vertices = heights.data(), field.vertex_count = 9;
  field.columns = 3, field.rows = 3, field.spacing = 2;
  const Mesh hill = MeshOf(field, 0);
  ASSERT_EQ(hill.size(), 24u);
  float highest = 0;
  for (const Vertex& vertex : hill) {
    EXPECT_LE(std::abs(vertex.position.x), 2);
    EXPECT_GT(vertex.normal.y, 0);
    highest = std::max(highest, vertex.position.y);
  }
  EXPECT_EQ(highest, 5);
  for (const Vertex& vertex : MeshOf(Shape(TESSERA_SHAPE_PLANE, 0, 1, 0, 3), 50)) {
    EXPECT_NEAR(vertex.position.y, 3, 1e-6);
    EXPECT_NEAR(vertex.normal.y, 1, 1e-6);
  }
}

SDL_Event Key(SDL_Scancode key, bool down) {
  SDL_Event event{};
  event.type = down ? SDL_KEYDOWN : SDL_KEYUP;
  event.key.keysym.scancode = key;
  return event;
}

SDL_Event Stick(SDL_GameControllerAxis axis, int value) {
  SDL_Event event{};
  event.type = SDL_CONTROLLERAXISMOTION;
  event.caxis.axis = static_cast<Uint8>(axis);
  event.caxis.value = static_cast<Sint16>(value);
  return event;
}

tessera::SceneInfo SceneOf(double force_n, double walk_m_s) {
  tessera::SceneInfo scene = TESSERA_SCENE_INFO;
  scene.player_max_force_n = force_n;
  scene.character_walk_speed_m_s = walk_m_s;
  return scene;
}

TEST(HandsTest, PushTheWayTheCameraLooks) {
  Hands hands;
  hands.Take(Key(SDL_SCANCODE_W, true));
  tessera::Steering ahead = hands.Steer(SceneOf(100, 0));
  EXPECT_NEAR(ahead.force[0], 0, 1e-4);
  EXPECT_NEAR(ahead.force[2], -100, 1e-3);
  // A quarter turn to the left: ahead is -x, as LookDirection has it.
  hands.Take(Key(SDL_SCANCODE_LEFT, true));
  while (hands.yaw() < 1.5707F) hands.Advance(1e-4F);
  ahead = hands.Steer(SceneOf(100, 0));
  EXPECT_NEAR(ahead.force[0], -100, 0.1);
  EXPECT_NEAR(ahead.force[2], 0, 0.1);
  const Vec3 look = LookDirection(hands.yaw(), 0);
  EXPECT_NEAR(look.x, ahead.force[0] / 100, 1e-3);
  EXPECT_NEAR(look.z, ahead.force[2] / 100, 1e-3);
  hands.LetGo();
  EXPECT_EQ(hands.Steer(SceneOf(100, 0)).force[0], 0);
}

TEST(HandsTest, CharactersWalkLookAndJump) {
  Hands hands;
  for (const SDL_Scancode key : {SDL_SCANCODE_W, SDL_SCANCODE_D, SDL_SCANCODE_SPACE, SDL_SCANCODE_LSHIFT}) {
    hands.Take(Key(key, true));
  }
  const tessera::Steering steering = hands.Steer(SceneOf(0, 3));
  EXPECT_NEAR(std::hypot(steering.move[0], steering.move[1]), 1, 1e-5);
  EXPECT_GT(steering.move[0], 0);
  EXPECT_GT(steering.move[1], 0);
  EXPECT_EQ(steering.buttons, 3u);
  EXPECT_EQ(steering.force[2], 0);
}

TEST(HandsTest, GamepadSteersAndRests) {
  Hands hands;
  hands.Take(Stick(SDL_CONTROLLER_AXIS_LEFTY, -32768));
  hands.Take(Stick(SDL_CONTROLLER_AXIS_LEFTX, 2000));  // a stick that rests
  const tessera::Steering steering = hands.Steer(SceneOf(0, 3));
  EXPECT_EQ(steering.move[0], 0);
  EXPECT_EQ(steering.move[1], 1);
  hands.Take(Stick(SDL_CONTROLLER_AXIS_RIGHTX, 32767));
  hands.Advance(0.5F);
  EXPECT_LT(hands.yaw(), -0.5F);  // to the right
}

std::optional<Script> ScriptOf(const std::string& text, std::string& error) {
  const std::string file = testing::TempDir() + "desktop_script";
  std::ofstream(file) << text;
  return Script::Read(file, error);
}

TEST(ScriptTest, DoesOneStepAfterAnother) {
  std::string error;
  auto script =
      ScriptOf("# a comment\nwait world\nframes 2\nscreenshot a.png\nwait moved 3\nreport a.txt\nquit\n", error);
  ASSERT_TRUE(script.has_value()) << error;
  Shown shown;
  shown.screen = "menu";
  EXPECT_EQ(script->Advance(shown).screenshot, "");
  shown.screen = "world";
  EXPECT_EQ(script->Advance(shown).screenshot, "");
  EXPECT_EQ(script->Advance(shown).screenshot, "");
  EXPECT_EQ(script->Advance(shown).screenshot, "a.png");
  shown.own_position = {{1, 0, 0}};
  EXPECT_FALSE(script->Advance(shown).quit);
  shown.own_position = {{1, 0, -2.9}};
  EXPECT_FALSE(script->Advance(shown).quit);
  shown.own_position = {{1, 0, -3}};
  const Script::Orders last = script->Advance(shown);
  EXPECT_EQ(last.report, "a.txt");
  EXPECT_TRUE(last.quit);
}

TEST(ScriptTest, WaitsForRestByTheWorldsTime) {
  std::string error;
  auto script = ScriptOf("wait rest\nquit\n", error);
  ASSERT_TRUE(script.has_value()) << error;
  Shown shown;
  shown.ticks_per_second = 60;
  shown.camera_arrived = true;
  const auto ends = [&](std::uint64_t tick) {
    shown.tick = tick;
    return script->Advance(shown).quit;
  };
  EXPECT_FALSE(ends(1000)) << "there is no own body yet";
  EXPECT_FALSE(ends(1100));
  shown.own_position = {{0, 2, 0}};
  for (int frame = 0; frame < 500; ++frame) EXPECT_FALSE(ends(1200)) << "no frame lets the world's time go on";
  shown.own_position = {{0, 1, 0}};
  EXPECT_FALSE(ends(1300)) << "it has fallen";
  shown.own_position = {{0, 1.002, 0}};
  EXPECT_FALSE(ends(1359));
  shown.camera_arrived = false;
  EXPECT_FALSE(ends(1360));
  shown.camera_arrived = true;
  EXPECT_TRUE(ends(1361));
}

TEST(ScriptTest, SaysWhatMakesNoSense) {
  std::string error;
  EXPECT_FALSE(ScriptOf("wait world\njump\n", error).has_value());
  EXPECT_NE(error.find(":2: no step 'jump'"), std::string::npos) << error;
  error.clear();
  EXPECT_FALSE(ScriptOf("press Nothing\n", error).has_value());
  EXPECT_NE(error.find("no key 'Nothing'"), std::string::npos) << error;
  error.clear();
  EXPECT_FALSE(Script::Read("/nowhere/script", error).has_value());
  EXPECT_EQ(error, "/nowhere/script: cannot be read");
}

Options Parsed(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), "tessera-desktop");
  std::vector<char*> argv;
  argv.reserve(arguments.size());
  for (std::string& argument : arguments) argv.push_back(argument.data());
  return ParseOptions(static_cast<int>(argv.size()), argv.data());
}

TEST(OptionsTest, AreReadAndRefused) {
  const Options good = Parsed({"--control", "a:1", "--size", "640x480", "--frames", "9", "--screenshot", "x.png"});
  EXPECT_EQ(good.error, "");
  EXPECT_EQ(good.control, "a:1");
  EXPECT_EQ(good.width, 640);
  EXPECT_EQ(good.frames, 9);
  EXPECT_EQ(Parsed({"--colour", "red"}).error, "no option --colour");
  EXPECT_EQ(Parsed({"--control"}).error, "--control needs a value");
  EXPECT_EQ(Parsed({"--frames", "9x"}).error, "--frames: not a number from 1: 9x");
  EXPECT_EQ(Parsed({"--size", "10x10"}).error, "--size: not 320x240 to 7680x4320: 10x10");
  EXPECT_EQ(Parsed({"--ticket", "/nowhere/ada"}).error, "--ticket: /nowhere/ada cannot be read");
  const std::string file = testing::TempDir() + "/ada.ticket";
  std::ofstream(file) << "\n";
  EXPECT_EQ(Parsed({"--ticket", file}).error, "--ticket: " + file + " has no ticket in it");
  std::ofstream(file) << " AVZH \n";
  EXPECT_EQ(Parsed({"--ticket", file}).ticket, "AVZH");
  EXPECT_EQ(Parsed({"--screenshot", "x.png"}).error, "--screenshot needs --frames: it is the last that is taken");
}

TEST(ProfileTest, TellsTheLastSecondFromAllBefore) {
  // 100 frames of 10 ms, then 20 of 40 ms.
  const tessera_duration before = {100, 0.010, 0, 0, 0}, now = {120, 1.8 / 120, 0, 0, 0};
  const Timing timing = TimingOf(now, before);
  EXPECT_NEAR(timing.recent_ms, 40, 1e-6);
  EXPECT_NEAR(timing.mean_ms, 15, 1e-6);
  EXPECT_EQ(TimingOf(now, now).recent_ms, 0);
  tessera::RegionStats stats = TESSERA_REGION_INFO;
  EXPECT_FALSE(ProfileOf(stats).known);
  EXPECT_EQ(ProfileOf(stats).physics.mean_ms, 0);
  stats.reports = 2;
  stats.physics = {50, 0.1, 0.003};
  stats.process_physical_bytes = 3 << 20;
  EXPECT_NEAR(ProfileOf(stats).physics.mean_ms, 2, 1e-9);
  EXPECT_NEAR(ProfileOf(stats).physics.recent_ms, 3, 1e-9);
  EXPECT_NEAR(ProfileOf(stats).process_physical_mib, 3, 1e-9);
}

// The number that a text begins with.
double NumberIn(const std::string& text) { return std::atof(text.c_str()); }

// A work that took `before_s` each of the first 100 times, and `recent_s` each of 30 more.
struct Measured {
  tessera_duration before, now;
};
Measured MeasuredAs(double before_s, double recent_s) {
  constexpr std::uint64_t kBefore = 100, kSince = 30;
  const double spent_s = before_s * kBefore + recent_s * kSince;
  return {{kBefore, before_s, 0, 0, 0}, {kBefore + kSince, spent_s / (kBefore + kSince), 0, 0, 0}};
}

void ExpectShown(const std::string& label, const Panel::Cell& cell, double value) {
  EXPECT_NEAR(NumberIn(cell.text), value, 0.0051 * value) << label << " is shown as " << cell.text;
}

TEST(ProfileTest, ThePanelShowsEachFigureOfTheClientToItsThirdDigit) {
  const Measured frame = MeasuredAs(0.010, 0.0333), network = MeasuredAs(0.001, 42e-6), update = MeasuredAs(1, 1.23e-6);
  Figures figures;
  figures.before.frame_time = frame.before, figures.now.frame_time = frame.now;
  figures.before.network_time = network.before, figures.now.network_time = network.now;
  figures.before.update_time = update.before, figures.now.update_time = update.now;
  figures.now.round_trip_s = 0.37e-3;
  figures.now.render_delay_s = 83.46e-3;
  figures.now.bytes_in_per_s = 123'456;
  figures.now.bytes_out_per_s = 514;
  figures.now.bodies = 21'763;
  figures.now.tick_rate_hz = 59.94;
  const std::vector<std::pair<std::string, double>> expected = {
      {"frames", 1 / 0.0333}, {"frame time", 33.3},    {"network time", 0.042}, {"update time", 1.23e-3},
      {"round trip", 0.37},   {"shown behind", 83.46}, {"received", 123.456},   {"sent", 0.514},
      {"bodies", 21'763},     {"world", 59.94}};
  const Panel panel = PanelOf(ProfileOf(figures));
  ASSERT_EQ(panel.client.size(), expected.size()) << "each has its check";
  for (std::size_t i = 0; i < expected.size(); ++i) {
    ASSERT_EQ(panel.client[i].label, expected[i].first);
    ASSERT_EQ(panel.client[i].cells.size(), 1u);
    ExpectShown(expected[i].first, panel.client[i].cells[0], expected[i].second);
  }
  EXPECT_EQ(panel.client.back().cells[0].text, "59.9 ticks/s");
}

TEST(ProfileTest, ThePanelShowsEachFigureOfARegionAndSaysOfWhichTime) {
  tessera::RegionStats busy = TESSERA_REGION_INFO, rests = TESSERA_REGION_INFO, silent = TESSERA_REGION_INFO;
  busy.region = 1, rests.region = 2, silent.region = 3;
  busy.connected = rests.connected = 1;
  busy.reports = rests.reports = 2;
  busy.physics = {60, 0.1, 1.234e-3}, busy.prediction = {60, 0.1, 41.2e-6};
  busy.snapshot_full = {1, 0.1, 3e-3}, busy.snapshot_delta = {30, 0.1, 250e-6}, busy.step = {60, 0.1, 16.66e-3};
  busy.bodies = 500, busy.ghosts = 20, busy.asleep = 100;
  busy.process_virtual_bytes = std::uint64_t{1234} << 20, busy.process_physical_bytes = 22 << 20;
  busy.host_virtual_usable_bytes = std::uint64_t{6} << 30, busy.host_virtual_total_bytes = std::uint64_t{8} << 30;
  busy.host_physical_usable_bytes = std::uint64_t{1} << 30, busy.host_physical_total_bytes = std::uint64_t{4} << 30;
  rests.physics = {50, 0.1, 0};
  Figures figures;
  figures.regions = {silent, busy, rests};
  const Panel panel = PanelOf(ProfileOf(figures));
  const std::vector<std::pair<std::string, double>> expected = {{"physics update", 1.234},
                                                                {"prediction", 0.0412},
                                                                {"full snapshots", 3},
                                                                {"delta snapshots", 0.25},
                                                                {"whole tick", 16.66},
                                                                {"bodies", 500},
                                                                {"ghosts", 20},
                                                                {"asleep", 100},
                                                                {"virtual memory, MiB", 1234},
                                                                {"physical memory, MiB", 22}};
  ASSERT_EQ(panel.regions.size(), expected.size()) << "each has its check";
  for (std::size_t i = 0; i < expected.size(); ++i) {
    ASSERT_EQ(panel.regions[i].label, expected[i].first);
    ASSERT_EQ(panel.regions[i].cells.size(), 3u);
    EXPECT_FALSE(panel.regions[i].cells[1].of_all);
    ExpectShown(expected[i].first, panel.regions[i].cells[1], expected[i].second);
  }
  EXPECT_EQ(panel.regions[0].cells[0].text, "-") << "it has not sent its figures";
  EXPECT_TRUE(panel.regions[0].cells[2].of_all);
  EXPECT_EQ(panel.regions[0].cells[2].text, "2.00");
  ASSERT_EQ(panel.host.size(), 2u);
  EXPECT_EQ(panel.host[0].text, "6144 of 8192 MiB usable");
  EXPECT_NEAR(panel.host[0].share, 0.75, 1e-9);
  EXPECT_EQ(panel.host[1].text, "1024 of 4096 MiB usable");
  const std::string text = Text(panel);
  EXPECT_NE(text.find("panel region 1 physics update: 1.23\n"), std::string::npos) << text;
  EXPECT_NE(text.find("panel region 2 physics update (of all): 2.00\n"), std::string::npos) << text;
  EXPECT_NE(text.find("panel virtual, host: 6144 of 8192 MiB usable\n"), std::string::npos) << text;
  EXPECT_NE(Text(figures).find("region 1 physics.recent 0.001234\n"), std::string::npos) << Text(figures);

  figures.regions.assign(11, rests);
  const Panel many = PanelOf(ProfileOf(figures));
  EXPECT_EQ(many.columns.size(), 8u);
  EXPECT_EQ(many.more, 3u);
  EXPECT_EQ(many.regions[0].cells.size(), 8u);
}

}  // namespace
}  // namespace desktop
