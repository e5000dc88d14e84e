// The plug-in's own code, from the engine's first call to the last, in an engine that is a fake (fake_engine.h), and in
// a world that is none: a region of this process, with a game.
#include <gmock/gmock.h>
#include <tessera/tessera.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "client_sdk/godot/engine.h"
#include "client_sdk/godot/test/fake_engine.h"
#include "client_sdk/local/local_world.h"
#include "host/temporary_folder.h"

namespace godot_plugin {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr char kScene[] = R"({
  "name": "yard", "tick_rate_hz": 60,
  "bounds": {"min": {"x": -20, "y": -5, "z": -20}, "max": {"x": 20, "y": 20, "z": 20}},
  "properties": [{"name": "health", "number": 100}, {"name": "team", "text": "red"}],
  "instance_properties": [{"name": "score", "number": 0}],
  "bodies": [
    {"id": 1, "motion": "MOTION_STATIC", "shape": {"plane": {"normal": {"y": 1}}}},
    {"id": 2, "mass": 1, "shape": {"sphere": {"radius": 0.5}}, "pose": {"position": {"x": 5, "y": 5}}},
    {"id": 3, "mass": 1, "shape": {"box": {"half_extents": {"x": 1, "y": 0.5, "z": 1}}},
     "pose": {"position": {"x": -5, "y": 0.5}}},
    {"id": 4, "mass": 1, "shape": {"compound": {"children": [
       {"shape": {"box": {"half_extents": {"x": 0.5, "y": 0.5, "z": 0.5}}}, "pose": {"position": {"x": -1}}},
       {"shape": {"box": {"half_extents": {"x": 0.5, "y": 0.5, "z": 0.5}}}, "pose": {"position": {"x": 1}}}]}},
     "pose": {"position": {"z": -6, "y": 0.5}}}
  ],
  "player": {"body": {"mass": 80, "shape": {"sphere": {"radius": 0.5}}}, "spawn_points": [{"y": 0.5}],
             "max_force": 800, "max_speed": 5}
})";

constexpr char kGame[] = R"(
function on_command(player, bytes)
  if bytes == 'end' then return player:kick('enough') end
  if bytes == 'remove' then return world.ray(vec(-5, 4, 0), vec(-5, 0, 0)).body:remove() end
  world.score = world.score + 1
  player:body().health = 55
  player:send('echo', { text = bytes, whole = 3, real = 0.5, yes = true, at = vec(1, 2, 3), mine = player:body() })
end)";

struct GodotPluginTest : testing::Test {
  void SetUp() override {
    auto opened = tessera::local::LocalWorld::Open({.scene = kScene, .game = kGame});
    ASSERT_TRUE(opened.ok()) << opened.status();
    world = *std::move(opened);
    ASSERT_TRUE(engine.Load());
  }
  void TearDown() override {
    if (node != 0) engine.Destroy(node);
    node = 0;
    engine.Unload();
    EXPECT_EQ(engine.live_values, 0) << "values that were made and not destroyed, less those destroyed twice";
    EXPECT_THAT(engine.OfClass("ArrayMesh"), IsEmpty());
    EXPECT_THAT(engine.OfClass("Node3D"), IsEmpty());
  }
  void Add(std::map<std::string, FakeValue> properties = {}) {
    const auto grant = world->Grant();
    ASSERT_TRUE(grant.ok());
    properties.emplace("grant", FakeValue::Bytes(*grant));
    node = engine.AddWorldNode(properties);
  }
  // Frames until it holds.
  testing::AssertionResult Until(const std::function<bool()>& holds) {
    const auto limit = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (!holds()) {
      const auto now = std::chrono::steady_clock::now();
      if (now > limit) return testing::AssertionFailure() << "never; " << testing::PrintToString(engine.errors);
      const absl::Status advanced = world->Advance(now);
      if (!advanced.ok()) return testing::AssertionFailure() << advanced;
      engine.Frame();
    }
    return testing::AssertionSuccess();
  }
  const std::vector<FakeSignal>& Signals() { return engine.Find(node)->signals; }
  const FakeSignal* Signal(const std::string& name, std::int64_t first = -1) {
    for (const FakeSignal& signal : Signals()) {
      if (signal.name == name && (first < 0 || signal.arguments.at(0).integer == first)) return &signal;
    }
    return nullptr;
  }
  FakeObject* NodeOf(std::int64_t body) {
    const FakeValue found = engine.Call(node, "body_node", {FakeValue::Int(body)});
    EXPECT_EQ(found.object, engine.CallTyped(node, "body_node", {FakeValue::Int(body)}).object);
    return engine.Find(found.object);
  }
  // Where a node was put last: the engine's transform has three rows of a basis, then the origin.
  std::array<float, 12> TransformOf(const FakeObject& object) {
    return object.last_call.at("set_transform")[0].numbers;
  }
  bool IsInside() { return Signal("joined") != nullptr; }

  FakeEngine engine;
  std::unique_ptr<tessera::local::LocalWorld> world;
  std::uint64_t node = 0;
};

// A quarter of a turn about y: z becomes x, and x becomes -z.
TEST(GodotPoseTest, ABasisHasTheTurnedAxesInItsColumns) {
  const double half = std::sqrt(0.5);
  const Pose turned{{1, 2, 3}, {0, half, 0, half}};
  const std::array<float, 12> rows = turned.Rows();
  constexpr std::array<float, 12> kExpected = {0, 0, 1, 1, 0, 1, 0, 2, -1, 0, 0, 3};
  for (std::size_t i = 0; i < rows.size(); ++i) EXPECT_NEAR(rows[i], kExpected[i], 1e-6) << i;
}

TEST(GodotPoseTest, APartIsTurnedAndMovedWithItsBody) {
  const double half = std::sqrt(0.5);
  const Pose body{{1, 2, 3}, {0, half, 0, half}}, part{{0, 0, 5}, {0, half, 0, half}};
  const Pose whole = body.Of(part);
  EXPECT_NEAR(whole.position[0], 6, 1e-9);
  EXPECT_NEAR(whole.position[1], 2, 1e-9);
  EXPECT_NEAR(whole.position[2], 3, 1e-9);
  EXPECT_NEAR(std::abs(whole.orientation[1]), 1, 1e-9) << "half a turn";
}

TEST(GodotPluginLoadTest, AnEngineThatIsTooOldIsRefused) {
  FakeEngine engine;
  engine.lacks = "classdb_register_extension_class2";
  EXPECT_FALSE(engine.Load());
  engine.lacks = "";
  EXPECT_TRUE(engine.Load());
  engine.Unload();
  EXPECT_FALSE(engine.class_registered);
  EXPECT_EQ(engine.live_values, 0);
}

TEST_F(GodotPluginTest, EveryPropertyHasAGetterAndASetterOfItsType) {
  EXPECT_THAT(engine.properties, SizeIs(8));
  for (const auto& [name, property] : engine.properties) {
    ASSERT_TRUE(engine.methods.count(property.setter) && engine.methods.count(property.getter)) << name;
    EXPECT_THAT(engine.methods.at(property.setter).arguments, SizeIs(1));
    EXPECT_EQ(engine.methods.at(property.setter).arguments[0].type, property.described.type) << name;
    EXPECT_EQ(engine.methods.at(property.getter).result.type, property.described.type) << name;
  }
  EXPECT_EQ(engine.properties.at("drawing").described.hint, "Nothing,Nodes,MultiMesh");
  EXPECT_EQ(engine.methods.at("body_node").result.class_name, "Node3D");
}

TEST_F(GodotPluginTest, PropertiesKeepWhatTheyAreGiven) {
  node = engine.AddWorldNode({{"address", FakeValue::Text("")},
                              {"grant_file", FakeValue::Text("")},
                              {"player_name", FakeValue::Text("Zoë")},
                              {"predict", FakeValue::Bool(false)},
                              {"drawing", FakeValue::Int(2)}});
  EXPECT_EQ(engine.GetProperty(node, "player_name").text, "Zoë");
  EXPECT_EQ(engine.GetProperty(node, "predict").integer, 0);
  EXPECT_EQ(engine.GetProperty(node, "drawing").integer, 2);
  EXPECT_THAT(engine.GetProperty(node, "grant").packed, IsEmpty());
  engine.SetProperty(node, "drawing", FakeValue::Int(7));
  EXPECT_EQ(engine.GetProperty(node, "drawing").integer, 2);
  EXPECT_THAT(engine.errors, ElementsAre(HasSubstr("drawing: 7")));
  engine.SetProperty(node, "grant", FakeValue::Bytes({1, 2, 3}));
  EXPECT_THAT(engine.CallTyped(node, "get_grant", {}).packed, ElementsAre(1, 2, 3));
  EXPECT_THAT(Signals(), IsEmpty()) << "without a grant nobody joins";
}

TEST_F(GodotPluginTest, JoinsByAGrantAndDrawsEachBodyAsANode) {
  Add();
  ASSERT_TRUE(Until([&] { return Signal("body_entered", 2) != nullptr && NodeOf(2) != nullptr; }));
  EXPECT_EQ(Signal("joined")->arguments[0].integer, 1);
  EXPECT_EQ(Signal("joined")->arguments[1].text, "yard");
  FakeObject* ball = NodeOf(2);
  EXPECT_EQ(Signal("body_entered", 2)->arguments[1].object, ball->id);
  EXPECT_EQ(ball->parent, node);
  EXPECT_EQ(ball->last_call.at("set_name")[0].text, "body_2");
  ASSERT_TRUE(Until([&] { return TransformOf(*ball)[10] < 1; })) << "the ball falls";
  EXPECT_NEAR(TransformOf(*ball)[9], 5, 0.1);
  ASSERT_TRUE(Until([&] { return NodeOf(3) != nullptr && NodeOf(4) != nullptr; }));
  EXPECT_THAT(NodeOf(4)->children, SizeIs(2)) << "a compound's parts";
  const std::array<float, 12> left = TransformOf(*engine.Find(NodeOf(4)->children[0]));
  EXPECT_NEAR(std::abs(left[9]), 1, 1e-3);
  EXPECT_THAT(engine.OfClass("MeshInstance3D"), SizeIs(6)) << "ground, ball, box, two of the compound, the player";
  EXPECT_EQ(engine.Call(node, "get_state", {}).integer, TESSERA_PLAYING);
  EXPECT_EQ(engine.CallTyped(node, "get_player", {}).integer, 1);
}

TEST_F(GodotPluginTest, MeshesAreClockwiseWithNormalsOutward) {
  Add();
  ASSERT_TRUE(Until([&] { return IsInside() && NodeOf(3) != nullptr; }));
  const FakeObject* instance = engine.Find(NodeOf(3)->children.at(0));
  const FakeObject* mesh = engine.Find(instance->last_call.at("set_mesh")[0].object);
  ASSERT_NE(mesh, nullptr);
  const std::vector<FakeValue>& surface = mesh->last_call.at("add_surface_from_arrays");
  EXPECT_EQ(surface[0].integer, 3) << "triangles";
  ASSERT_THAT(surface[1].array, SizeIs(13));
  const std::vector<float> at = surface[1].array[0].Floats(), normals = surface[1].array[1].Floats();
  ASSERT_THAT(at, SizeIs(12 * 9)) << "a box has twelve triangles";
  ASSERT_EQ(normals.size(), at.size());
  for (std::size_t i = 0; i < at.size(); i += 9) {
    const auto corner = [&](std::size_t c, std::size_t axis) { return at[i + 3 * c + axis]; };
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
      const float cross = (corner(1, u) - corner(0, u)) * (corner(2, v) - corner(0, v)) -
                          (corner(1, v) - corner(0, v)) * (corner(2, u) - corner(0, u));
      EXPECT_LE(cross * normals[i + axis], 1e-6F) << "seen from outside the corners go clockwise";
      EXPECT_GE(corner(0, axis) * normals[i + axis], -1e-6F);
    }
  }
}

TEST_F(GodotPluginTest, DrawsAMultiMeshForEachPartOfAShape) {
  Add({{"drawing", FakeValue::Int(2)}});
  ASSERT_TRUE(Until([&] { return Signal("body_entered", 4) != nullptr && Signal("body_entered", 2) != nullptr; }));
  ASSERT_TRUE(Until([&] { return engine.OfClass("MultiMesh").size() == 4; })) << "balls, box, two parts";
  EXPECT_EQ(NodeOf(2), nullptr);
  EXPECT_EQ(Signal("body_entered", 2)->arguments[1].object, 0U);
  std::multiset<std::int64_t> counts;
  for (const FakeObject* multimesh : engine.OfClass("MultiMesh")) {
    EXPECT_EQ(multimesh->last_call.at("set_transform_format")[0].integer, 1);
    counts.insert(multimesh->last_call.at("set_visible_instance_count")[0].integer);
    const std::int64_t room = multimesh->last_call.at("set_instance_count")[0].integer;
    EXPECT_EQ(multimesh->last_call.at("set_buffer")[0].Floats().size(), static_cast<std::size_t>(12 * room));
  }
  EXPECT_THAT(counts, ElementsAre(1, 1, 1, 2)) << "the ball and the player have one shape";
  // The falling ball: the fourth of each row is where it is.
  EXPECT_TRUE(Until([&] {
    for (const FakeObject* multimesh : engine.OfClass("MultiMesh")) {
      const std::vector<float> rows = multimesh->last_call.at("set_buffer")[0].Floats();
      for (std::size_t at = 0; at < rows.size(); at += 12) {
        if (std::abs(rows[at + 3] - 5) < 0.1F && rows[at + 7] < 1) return true;
      }
    }
    return false;
  }));
}

TEST_F(GodotPluginTest, ABodyThatStandsIsNotMovedAgainAndOneThatIsGoneIsFreed) {
  Add();
  ASSERT_TRUE(Until([&] { return IsInside() && NodeOf(3) != nullptr && TransformOf(*NodeOf(2))[10] < 1; }));
  const std::uint64_t box = NodeOf(3)->id;
  int before = 0;
  std::uint64_t since = 0;
  ASSERT_TRUE(Until([&] {
    const int now = NodeOf(3)->calls["set_transform"];
    if (now != std::exchange(before, now)) since = world->tick().value();
    return world->tick().value() > since + 60;
  })) << "it comes to rest, and for a second nothing moves it";
  EXPECT_EQ(engine.Call(node, "send", {FakeValue::Text("remove")}).integer, TESSERA_OK);
  ASSERT_TRUE(Until([&] { return Signal("body_left", 3) != nullptr && engine.Find(box) == nullptr; }));
  EXPECT_EQ(NodeOf(3), nullptr);
}

TEST_F(GodotPluginTest, ANodeThatAScriptFreedIsLeftAlone) {
  Add();
  ASSERT_TRUE(Until([&] { return IsInside() && NodeOf(2) != nullptr; }));
  engine.Destroy(NodeOf(2)->id);
  const std::uint64_t tick = world->tick().value();
  EXPECT_TRUE(Until([&] { return world->tick().value() > tick + 20; }));
  EXPECT_EQ(NodeOf(2), nullptr);
}

TEST_F(GodotPluginTest, ScriptsPushTheOwnBodyAndTalkWithTheGame) {
  Add();
  ASSERT_TRUE(Until([&] { return engine.Call(node, "get_state", {}).integer == TESSERA_PLAYING; }));
  const FakeValue own = engine.Call(node, "get_own_body", {});
  ASSERT_TRUE(Until([&] { return NodeOf(own.integer) != nullptr; }));
  ASSERT_TRUE(Until([&] {
    engine.CallTyped(node, "push", {FakeValue::Vector3(800, 0, 0), FakeValue::Vector3(0, 0, 0)});
    return TransformOf(*NodeOf(own.integer))[9] > 1;
  }));
  EXPECT_EQ(engine.CallTyped(node, "send", {FakeValue::Text("grüß")}).integer, TESSERA_OK);
  EXPECT_EQ(engine.Call(node, "send_bytes", {FakeValue::Bytes({'a', 'b'})}).integer, TESSERA_OK);
  ASSERT_TRUE(Until([&] {
    return std::count_if(Signals().begin(), Signals().end(),
                         [](const auto& one) { return one.name == "game_event"; }) == 2;
  }));
  const FakeSignal& echo = *Signal("game_event");
  EXPECT_EQ(echo.arguments[0].text, "echo");
  const std::map<std::string, FakeValue>& values = echo.arguments[1].dictionary;
  EXPECT_EQ(values.at("text").text, "grüß");
  EXPECT_EQ(values.at("whole").integer, 3);
  EXPECT_EQ(values.at("real").real, 0.5);
  EXPECT_EQ(values.at("yes").type, abi::kBool);
  EXPECT_EQ(values.at("at").numbers[2], 3);
  EXPECT_EQ(values.at("mine").integer, own.integer);
  const std::vector<FakeValue> health = {own, FakeValue::Text("health")};
  EXPECT_TRUE(Until([&] { return engine.Call(node, "body_property", health).integer == 55; }));
  EXPECT_EQ(engine.CallTyped(node, "body_property", {own, FakeValue::Text("team")}).text, "red");
  EXPECT_EQ(engine.Call(node, "world_property", {FakeValue::Text("nonsense")}).type, abi::kNil);
  EXPECT_TRUE(Until([&] { return engine.CallTyped(node, "world_property", {FakeValue::Text("score")}).integer == 2; }));
  EXPECT_TRUE(std::any_of(Signals().begin(), Signals().end(), [](const FakeSignal& one) {
    return one.name == "event" && one.arguments[0].dictionary.at("property").text == "health";
  }));
}

TEST_F(GodotPluginTest, ACallWithWrongArgumentsIsRefused) {
  Add();
  abi::CallError error = engine.TryCall(node, "send", {FakeValue::Int(3)}, nullptr);
  EXPECT_EQ(error.kind, abi::kInvalidArgument);
  EXPECT_EQ(error.expected, abi::kString);
  EXPECT_EQ(engine.TryCall(node, "send", {}, nullptr).kind, abi::kTooFewArguments);
  EXPECT_EQ(engine.TryCall(node, "join", {FakeValue::Int(3)}, nullptr).kind, abi::kTooManyArguments);
  const std::vector<FakeValue> steering = {FakeValue::Vector2(0, 1), FakeValue::Int(0), FakeValue::Real(0.5),
                                           FakeValue::Int(1)};
  EXPECT_EQ(engine.TryCall(node, "steer", steering, nullptr).kind, abi::kCallOk) << "a whole number is a real one";
  EXPECT_EQ(engine.Call(node, "send", {FakeValue::Text(std::string(2000, 'x'))}).integer, TESSERA_INVALID_ARGUMENT);
  EXPECT_THAT(engine.Call(node, "get_last_error", {}).text, HasSubstr("2000"));
}

TEST_F(GodotPluginTest, ADamagedGrantSaysSoAndAnotherMayBeTried) {
  node = engine.AddWorldNode({{"grant", FakeValue::Bytes({1, 2, 3})}});
  ASSERT_NE(Signal("left"), nullptr);
  EXPECT_THAT(Signal("left")->arguments[0].text, HasSubstr("grant"));
  EXPECT_THAT(engine.errors, Contains(HasSubstr("grant")));
  engine.SetProperty(node, "grant", FakeValue::Bytes(*world->Grant()));
  EXPECT_EQ(engine.Call(node, "join", {}).integer, TESSERA_OK);
  EXPECT_TRUE(Until([&] { return IsInside(); }));
  EXPECT_EQ(engine.Call(node, "join", {}).integer, TESSERA_FAILED_PRECONDITION) << "it has one";
}

TEST_F(GodotPluginTest, AGrantIsReadFromAFileAndTheSceneIsKeptInTheFolder) {
  const tessera::host::TemporaryFolder folder;
  const std::string file = folder.path() + "/grant";
  const auto grant = world->Grant();
  std::ofstream(file, std::ios::binary)
      .write(reinterpret_cast<const char*>(grant->data()), static_cast<int>(grant->size()));
  node = engine.AddWorldNode({{"grant_file", FakeValue::Text(folder.path() + "/none")},
                              {"scene_cache_folder", FakeValue::Text(folder.path() + "/scenes")}});
  ASSERT_NE(Signal("left"), nullptr);
  EXPECT_THAT(Signal("left")->arguments[0].text, HasSubstr("grant_file"));
  engine.SetProperty(node, "grant_file", FakeValue::Text(file));
  EXPECT_EQ(engine.Call(node, "join", {}).integer, TESSERA_OK);
  ASSERT_TRUE(Until([&] { return IsInside(); }));
  EXPECT_FALSE(std::filesystem::is_empty(folder.path() + "/scenes"));
}

TEST_F(GodotPluginTest, AnAddressWithoutAControlPlaneSaysSo) {
  node = engine.AddWorldNode({{"address", FakeValue::Text("unix:/nowhere")}, {"instance", FakeValue::Text("inst-1")}});
  ASSERT_NE(Signal("left"), nullptr);
  EXPECT_NE(Signal("left")->arguments[0].text, "");
  EXPECT_EQ(engine.Call(node, "get_last_error", {}).text, Signal("left")->arguments[0].text);
}

TEST_F(GodotPluginTest, AKickedPlayerIsToldInTheGamesWords) {
  Add();
  ASSERT_TRUE(Until([&] { return engine.Call(node, "get_state", {}).integer == TESSERA_PLAYING; }));
  engine.Call(node, "send", {FakeValue::Text("end")});
  ASSERT_TRUE(Until([&] { return Signal("left") != nullptr; }));
  EXPECT_EQ(Signal("left")->arguments[0].text, "enough");
  engine.Frame();
  EXPECT_THAT(engine.OfClass("MeshInstance3D"), IsEmpty());
  EXPECT_EQ(engine.Call(node, "get_state", {}).integer, TESSERA_ENDED);
}

TEST_F(GodotPluginTest, AScriptMayLeaveAndJoinAgainInASignal) {
  Add();
  bool done = false;
  engine.on_signal = [&](const FakeSignal& signal) {
    if (signal.name != "body_entered" || done) return;
    done = true;
    engine.Call(node, "leave", {FakeValue::Int(100)});
    engine.SetProperty(node, "grant", FakeValue::Bytes(*world->Grant()));
    EXPECT_EQ(engine.Call(node, "join", {}).integer, TESSERA_OK);
  };
  ASSERT_TRUE(Until([&] { return Signal("joined", 2) != nullptr; }));
  EXPECT_EQ(Signal("left")->arguments[0].text, "");
  EXPECT_TRUE(Until([&] { return NodeOf(2) != nullptr; }));
  std::vector<std::string> names;
  for (const FakeSignal& signal : Signals()) names.push_back(signal.name);
  const auto left = std::find(names.begin(), names.end(), "left"), joined = std::find(left, names.end(), "joined");
  EXPECT_EQ(std::count(left, joined, "body_entered"), 0) << "the rest of that frame was of the world before";
}

TEST_F(GodotPluginTest, TheEditorJoinsNothing) {
  engine.editor_hint = true;
  Add();
  engine.Frame();
  EXPECT_THAT(Signals(), IsEmpty());
  EXPECT_EQ(engine.Call(node, "get_state", {}).integer, TESSERA_ENDED);
}

}  // namespace
}  // namespace godot_plugin
