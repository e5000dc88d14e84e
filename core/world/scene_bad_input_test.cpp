// One test for each way in which a scene can be wrong, except its shapes and joints, with the error in full.
#include "absl/strings/str_cat.h"
#include "core/world/limits.h"
#include "core/world/scene_faults.h"

namespace tessera {
namespace {

using namespace scene_faults;

TEST(BadSceneTest, TheSoundOneIsSound) {
  const auto scene = ResolveScene(Sound(), kFile);
  EXPECT_TRUE(scene.ok()) << scene.status();
}

TEST(BadSceneTest, TellsEveryFaultAndHowManyMoreThanTwentyThereAre) {
  EXPECT_EQ(Error([](v1::Scene& s) {
              s.mutable_bodies(1)->set_mass(-1);
              s.mutable_bodies(2)->set_mass(-2);
              s.mutable_player()->set_max_speed(0);
            }),
            "bodies[1] (id 40 \"crate\"): mass must be > 0, got -1; bodies[2] (id 41): mass must be > 0, got -2; "
            "player: max_speed must be > 0, got 0");
  const std::string many = Error([](v1::Scene& s) {
    for (std::uint64_t i = 0; i < 1000; ++i) {
      v1::Body& body = *s.add_bodies();
      body = s.bodies(2);
      body.set_id(1000 + i);
      body.set_name(std::string(63, 'x'));
      body.set_mass(-1);
    }
  });
  EXPECT_EQ(many.substr(many.rfind(" (and ")), " (and 980 more)");
  EXPECT_EQ(std::ranges::count(many, ';'), 19);
  EXPECT_LT(many.size(), 7000u) << "a gRPC status takes 8 KB";
}

// --- The scene as a whole ---

TEST(BadSceneTest, Name) {
  EXPECT_EQ(Error([](v1::Scene& s) { s.clear_name(); }),
            "name must be of lower case letters, digits and dashes, got \"\"");
  EXPECT_EQ(Error([](v1::Scene& s) { s.set_name("My Scene"); }),
            "name must be of lower case letters, digits and dashes, got \"My Scene\"");
  EXPECT_EQ(Error([](v1::Scene& s) { s.set_name("a\nb"); }),
            "name must be at most 63 bytes without control characters, quotes and backslashes, got \"a\\nb\"");
}

TEST(BadSceneTest, Empty) {
  EXPECT_EQ(Error([](v1::Scene& s) {
              s.clear_bodies();
              s.clear_scatters();
              s.clear_player();
              s.clear_joints();
            }),
            "the scene is empty: it has no bodies and no player");
}

TEST(BadSceneTest, Bounds) {
  EXPECT_EQ(Error([](v1::Scene& s) {
              v1::Scene none;
              none.set_name("x");
              none.mutable_player();
              s = none;
            }).substr(0, 53),
            "bounds has no volume: min.x is 0, max.x is 0; player.");
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_bounds()->mutable_max()->set_z(kNan); }).substr(0, 48),
            "bounds.max.z must be a finite number, got nan; b");
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_bounds()->mutable_max()->set_z(2e7); }),
            "bounds.max.z must be -1e+07 to 1e+07, got 2e+07");
}

TEST(BadSceneTest, TickRate) {
  EXPECT_EQ(Error([](v1::Scene& s) { s.set_tick_rate_hz(5); }), "tick_rate_hz must be 10 to 240, got 5");
  EXPECT_EQ(Error([](v1::Scene& s) { s.set_tick_rate_hz(1000); }), "tick_rate_hz must be 10 to 240, got 1000");
}

TEST(BadSceneTest, Gravity) {
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_gravity()->set_y(kInf); }),
            "gravity.y must be a finite number, got inf");
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_gravity()->set_y(-1e5); }),
            "gravity must be at most 10000 long, got 100000");
}

TEST(BadSceneTest, TooBig) {
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_scatters(0)->set_count(4'000'000'000); }),
            "bodies, scattered ones included, must be at most 1000000, got 4000000003");
}

TEST(BadSceneTest, Materials) {
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_materials(0)->set_friction(-1); }),
            "materials[0] (\"wood\"): friction must be >= 0, got -1");
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_materials(0)->set_restitution(1.5); }),
            "materials[0] (\"wood\"): restitution must be 0 to 1, got 1.5");
  EXPECT_EQ(Error([](v1::Scene& s) { *s.add_materials() = s.materials(0); }),
            "materials[1] (\"wood\"): name is used twice");
  EXPECT_EQ(Error([](v1::Scene& s) { s.add_materials(); }), "materials[1]: name is missing");
}

// --- Bodies ---

TEST(BadSceneTest, Mass) {
  EXPECT_EQ(CrateError([](v1::Body& b) { b.set_mass(-1); }), "mass must be > 0, got -1");
  EXPECT_EQ(CrateError([](v1::Body& b) { b.clear_mass(); }), "mass must be > 0, got 0");
  EXPECT_EQ(CrateError([](v1::Body& b) { b.set_mass(kNan); }), "mass must be a finite number, got nan");
  EXPECT_EQ(CrateError([](v1::Body& b) { b.set_mass(-kInf); }), "mass must be a finite number, got -inf");
  EXPECT_EQ(CrateError([](v1::Body& b) { b.set_mass(1e10); }), "mass must be 1e-06 to 1e+09, got 1e+10");
}

TEST(BadSceneTest, DuplicateIds) {
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_bodies(2)->set_id(1); }).substr(0, 50),
            "bodies[2] (id 1): id 1 is also that of bodies[0] (");
  EXPECT_EQ(Error([](v1::Scene& s) { *s.add_bodies() = s.bodies(1); }),
            "bodies[3] (id 40 \"crate\"): id 40 is also that of bodies[1] (id 40 \"crate\")");
  EXPECT_EQ(Error([](v1::Scene& s) {
              *s.add_bodies() = s.bodies(2);
              s.mutable_bodies(3)->set_id(108);
            }),
            "bodies[3] (id 108): id 108 is among the ids of scatters[0], 100 to 108");
  EXPECT_EQ(Error([](v1::Scene& s) {
              *s.add_scatters() = s.scatters(0);
              s.mutable_scatters(1)->set_first_id(92);
            }),
            "scatters[0]: first_id 100 is among the ids of scatters[1], 92 to 100");
  EXPECT_EQ(Error([](v1::Scene& s) { *s.add_joints() = s.joints(0); }),
            "joints[1] (id 1): id 1 is also that of joints[0]");
}

TEST(BadSceneTest, Layers) {
  EXPECT_EQ(CrateError([](v1::Body& b) { b.set_layer("debris"); }), "layer \"debris\" is not among the scene's layers");
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_player()->mutable_body()->set_layer("players"); }),
            "player.body: layer \"players\" is not among the scene's layers");
  EXPECT_EQ(Error([](v1::Scene& s) { s.add_layers()->set_name("de bris"); }),
            "layers[0]: name must be of 1 to 32 letters, digits and underscores, got \"de bris\"");
  EXPECT_EQ(Error([](v1::Scene& s) { s.add_layers(); }),
            "layers[0]: name must be of 1 to 32 letters, digits and underscores, got \"\"");
  EXPECT_EQ(Error([](v1::Scene& s) { s.add_layers()->set_name(std::string(33, 'x')); }).substr(0, 16),
            "layers[0]: name ");
  for (const char* name : {"debris", "default"}) {
    EXPECT_EQ(Error([&](v1::Scene& s) {
                s.add_layers()->set_name(name);
                s.add_layers()->set_name(name);
              }),
              "layers[1]: name \"" + std::string(name) + "\" is used twice");
  }
  EXPECT_EQ(Error([](v1::Scene& s) {
              s.add_layers()->set_name("debris");
              s.mutable_layers(0)->add_ignores("default");
              s.mutable_layers(0)->add_ignores("dust");
            }),
            "layers[0] (\"debris\"): ignores[1] \"dust\" is not among the scene's layers");
  EXPECT_EQ(Error([](v1::Scene& s) {
              s.add_layers()->set_name("debris");
              s.mutable_layers(0)->add_ignores("debris");
              s.mutable_layers(0)->add_ignores("debris");
            }),
            "layers[0] (\"debris\"): ignores[1] \"debris\" is named twice");
  EXPECT_EQ(Error([](v1::Scene& s) {
              for (int i = 0; i < 32; ++i) s.add_layers()->set_name(absl::StrCat("l", i));
            }),
            "layers[31]: is one layer too many: with \"default\" there may be 32");
}

TEST(BadSceneTest, IdOutOfRange) {
  EXPECT_EQ(Error([](v1::Scene& s) {
              s.clear_joints();
              s.mutable_bodies(1)->set_id(0);
            }),
            "bodies[1] (id 0 \"crate\"): id must be 1 to 4294967295, got 0");
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_bodies(0)->set_id(std::uint64_t{1} << 32); }),
            "bodies[0] (id 4294967296): id must be 1 to 4294967295, got 4294967296");
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_joints(0)->set_id(0); }), "joints[0] (id 0): id must be > 0, got 0");
}

TEST(BadSceneTest, BodyOutsideTheWorld) {
  EXPECT_EQ(CrateError([](v1::Body& b) { b.mutable_pose()->mutable_position()->set_x(11); }),
            "pose.position is outside the scene's bounds, got (11, 0, 0)");
  EXPECT_EQ(CrateError([](v1::Body& b) { b.mutable_pose()->mutable_position()->set_x(kNan); }),
            "pose.position.x must be a finite number, got nan");
}

TEST(BadSceneTest, Orientation) {
  EXPECT_EQ(CrateError([](v1::Body& b) { b.mutable_pose()->mutable_orientation()->set_w(0.5); }),
            "pose.orientation must have length 1, got 0.5");
  EXPECT_EQ(CrateError([](v1::Body& b) { b.mutable_pose()->mutable_orientation()->set_w(kNan); }),
            "pose.orientation must have length 1, got nan");
}

TEST(BadSceneTest, BodyFields) {
  EXPECT_EQ(CrateError([](v1::Body& b) { b.set_material("cheese"); }),
            "material \"cheese\" is not among the scene's materials");
  EXPECT_EQ(CrateError([](v1::Body& b) { b.mutable_linear_velocity()->set_z(2e4); }),
            "linear_velocity must be at most 10000 long, got 20000");
  EXPECT_EQ(CrateError([](v1::Body& b) { b.mutable_angular_velocity()->set_z(kNan); }),
            "angular_velocity.z must be a finite number, got nan");
  EXPECT_EQ(CrateError([](v1::Body& b) { b.set_linear_damping(1.5); }), "linear_damping must be 0 to 1, got 1.5");
  EXPECT_EQ(CrateError([](v1::Body& b) { b.set_angular_damping(-1); }), "angular_damping must be 0 to 1, got -1");
  EXPECT_EQ(CrateError([](v1::Body& b) { b.set_gravity_scale(kInf); }),
            "gravity_scale must be a finite number, got inf");
  EXPECT_EQ(Error([](v1::Scene& s) {
              s.mutable_gravity()->set_y(-100);
              s.mutable_bodies(1)->set_gravity_scale(-200);
            }),
            "bodies[1] (id 40 \"crate\"): gravity_scale times gravity must be at most 10000, got 20000");
  EXPECT_EQ(CrateError([](v1::Body& b) { b.set_motion(static_cast<v1::Motion>(7)); }),
            "motion must be MOTION_STATIC or MOTION_DYNAMIC, got 7");
  EXPECT_EQ(CrateError([](v1::Body& b) { b.set_kind("a crate"); }),
            "kind must be of at most 32 letters, digits and underscores, got \"a crate\"");
  EXPECT_EQ(CrateError([](v1::Body& b) { b.set_kind(std::string(33, 'k')); }),
            "kind must be of at most 32 letters, digits and underscores, got \"" + std::string(33, 'k') + "\"");
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_bodies(1)->set_name("a\"\n"); }),
            "bodies[1] (id 40 \"a\\\"\\n\"): name must be at most 63 bytes without control characters, quotes and "
            "backslashes, got \"a\\\"\\n\"");
}

TEST(BadSceneTest, Inertia) {
  const auto error = [](double x, double y, double z) {
    return CrateError([=](v1::Body& b) {
      b.mutable_inertia()->set_x(x);
      b.mutable_inertia()->set_y(y);
      b.mutable_inertia()->set_z(z);
    });
  };
  EXPECT_EQ(error(1, 0, 1), "inertia.y must be > 0, got 0");
  EXPECT_EQ(error(1, 1e-8, 1), "inertia.y must be 1e-07 to 1e+11, got 1e-08");
  EXPECT_EQ(error(1, 1, 1e12), "inertia.z must be 1e-07 to 1e+11, got 1e+12");
  EXPECT_EQ(error(1, 3, 1), "inertia is of no body: one moment, 3, exceeds the sum of the others");
}

TEST(BadSceneTest, StaticBodies) {
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_bodies(0)->set_mass(kNan); }),
            "bodies[0] (id 1): mass must be left out of a static body");
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_bodies(0)->mutable_linear_velocity()->set_x(1); }),
            "bodies[0] (id 1): linear_velocity must be left out of a static body");
}

// --- Scatters, fields, player ---

template <class Change>
std::string ScatterError(Change change) {
  const std::string place = "scatters[0]: ";
  const std::string error = Error([&](v1::Scene& scene) { change(*scene.mutable_scatters(0)); });
  EXPECT_EQ(error.substr(0, place.size()), place);
  return error.substr(std::min(place.size(), error.size()));
}

TEST(BadSceneTest, Scatters) {
  EXPECT_EQ(ScatterError([](v1::Scatter& s) { s.set_jitter(1.01); }), "jitter must be 0 to 1, got 1.01");
  EXPECT_EQ(ScatterError([](v1::Scatter& s) { s.set_spacing(kNan); }), "spacing must be a finite number, got nan");
  EXPECT_EQ(ScatterError([](v1::Scatter& s) { s.clear_templates(); }), "templates is empty: give at least one body");
  EXPECT_EQ(ScatterError([](v1::Scatter& s) { s.set_count(0); }), "count must be > 0, got 0");
  EXPECT_EQ(ScatterError([](v1::Scatter& s) { s.set_first_id(0); }),
            "first_id must be 1 to 4294967295 with room for count = 9, got 0");
  EXPECT_EQ(ScatterError([](v1::Scatter& s) { s.set_first_id(4294967290); }),
            "first_id must be 1 to 4294967295 with room for count = 9, got 4294967290");
  EXPECT_EQ(ScatterError([](v1::Scatter& s) { s.mutable_area()->mutable_max()->set_x(-8); }),
            "area has no volume: min.x is -8, max.x is -8");
  EXPECT_EQ(ScatterError([](v1::Scatter& s) { s.mutable_area()->mutable_max()->set_x(11); }),
            "area is not inside the scene's bounds");
  EXPECT_EQ(ScatterError([](v1::Scatter& s) { s.mutable_area()->mutable_max()->set_z(-7); }),
            "area must be at least one spacing, 2 m, wide in x and z");
  EXPECT_EQ(ScatterError([](v1::Scatter& s) { s.set_count(64 * 5 + 1); }),
            "count = 321 needs layers up to 11 m, above the scene's bounds.max.y = 10");
}

TEST(BadSceneTest, Templates) {
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_scatters(0)->mutable_templates(0)->set_mass(-1); }),
            "scatters[0].templates[0]: mass must be > 0, got -1");
  EXPECT_EQ(Error([](v1::Scene& s) {
              s.mutable_scatters(0)->mutable_templates(0)->set_name("pebble");
              s.mutable_scatters(0)->mutable_templates(0)->set_id(5);
            }),
            "scatters[0].templates[0] (\"pebble\"): id must be left out of a template, got 5");
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_scatters(0)->mutable_templates(0)->mutable_pose(); }),
            "scatters[0].templates[0]: pose must be left out of a template");
}

TEST(BadSceneTest, Fields) {
  EXPECT_EQ(Error([](v1::Scene& s) { s.add_fields(); }), "fields[2]: its kind is missing: give one of vortex, uniform");
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_fields(0)->mutable_vortex()->set_radius(0); }),
            "fields[0]: vortex.radius must be > 0, got 0");
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_fields(0)->mutable_vortex()->set_gain(61); }),
            "fields[0]: vortex.gain must be 0 to 60, got 61");
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_fields(0)->mutable_vortex()->mutable_center()->set_x(kNan); }),
            "fields[0]: vortex.center.x must be a finite number, got nan");
  EXPECT_EQ(Error([](v1::Scene& s) {
              s.mutable_fields(0)->mutable_vortex()->set_radius(1e6);
              s.mutable_fields(0)->mutable_vortex()->set_angular_velocity(-1);
            }),
            "fields[0]: vortex.angular_velocity * radius must be -10000 to 10000, got -1e+06");
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_fields(1)->mutable_uniform()->clear_bounds(); }),
            "fields[1]: uniform.bounds has no volume: min.x is 0, max.x is 0");
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_fields(1)->mutable_uniform()->mutable_acceleration()->set_y(kNan); }),
            "fields[1]: uniform.acceleration.y must be a finite number, got nan");
}

TEST(BadSceneTest, FieldsThatAddUpToTooMuch) {
  const auto vortex = [](v1::Scene& s, double x, double gain) {
    auto& added = *s.add_fields()->mutable_vortex();
    added.mutable_center()->set_x(x);
    added.set_radius(4);
    added.set_gain(gain);
  };
  EXPECT_EQ(Error([&](v1::Scene& s) { vortex(s, 8, 60); }).substr(0, 92),
            "fields[0]: vortex.gain, with that of the fields which overlap it, must be at most 60, got 61");
  v1::Scene apart = Sound();
  vortex(apart, 10, 60);
  EXPECT_TRUE(ResolveScene(apart, kFile).ok());
  EXPECT_EQ(Error([](v1::Scene& s) {
              *s.add_fields() = s.fields(1);
              s.mutable_fields(2)->mutable_uniform()->mutable_acceleration()->set_y(1e4);
            }).substr(0, 96),
            "fields[1]: uniform.acceleration, with that of the fields which overlap it, must be at most 10000");
  EXPECT_EQ(Error([](v1::Scene& s) {
              for (int i = 0; i < 255; ++i) *s.add_fields() = s.fields(1);
            }),
            "fields must be at most 256, got 257");
}

TEST(BadSceneTest, Player) {
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_player()->mutable_body()->clear_mass(); }),
            "player.body: mass must be > 0, got 0");
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_player()->mutable_body()->set_id(3); }),
            "player.body: id must be left out of a template, got 3");
  EXPECT_EQ(Error([](v1::Scene& s) {
              s.mutable_player()->mutable_body()->clear_mass();
              s.mutable_player()->mutable_body()->set_motion(v1::MOTION_STATIC);
            }),
            "player.body: motion must be MOTION_DYNAMIC");
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_player()->clear_spawn_points(); }),
            "player: spawn_points is empty: give at least one");
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_player()->add_spawn_points()->set_z(-10.5); }),
            "player: spawn_points[1] is outside the scene's bounds");
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_player()->set_max_force(-5); }),
            "player: max_force must be >= 0, got -5");
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_player()->set_max_force(1e6); }),
            "player: max_force must be at most 10000 m/s^2 times the body's mass, 800000, got 1e+06");
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_player()->set_max_speed(kNan); }),
            "player: max_speed must be a finite number, got nan");
  EXPECT_EQ(Error([](v1::Scene& s) { s.mutable_player()->set_max_force_up(-1); }),
            "player: max_force_up must be >= 0, got -1");
}

// The sound scene's player as a character.
v1::Character& CharacterOf(v1::Scene& scene) {
  v1::PlayerRules& player = *scene.mutable_player();
  player.clear_max_force();
  player.clear_max_speed();
  v1::Shape::Capsule& capsule = *player.mutable_body()->mutable_shape()->mutable_capsule();
  capsule.set_radius(0.4);
  capsule.set_half_height(0.5);
  return *player.mutable_character();
}

TEST(BadSceneTest, Characters) {
  v1::Scene sound = Sound();
  CharacterOf(sound);
  EXPECT_TRUE(ResolveScene(sound, kFile).ok());
  EXPECT_EQ(Error([](v1::Scene& s) {
              CharacterOf(s);
              s.mutable_player()->mutable_body()->mutable_shape()->mutable_sphere()->set_radius(1);
            }),
            "player: character needs a body.shape that is a capsule");
  EXPECT_EQ(Error([](v1::Scene& s) {
              CharacterOf(s);
              s.mutable_player()->set_max_force(5);
            }),
            "player: max_force, max_force_up and max_speed must be left out beside character: forces do not move it");
  EXPECT_EQ(Error([](v1::Scene& s) {
              CharacterOf(s);
              s.mutable_gravity()->set_y(0);
            }),
            "player: character needs gravity that points along -y");
  EXPECT_EQ(Error([](v1::Scene& s) { CharacterOf(s).set_walk_speed(51); }),
            "player: character.walk_speed must be 0.001 to 50, got 51");
  EXPECT_EQ(Error([](v1::Scene& s) { CharacterOf(s).set_jump_speed(1); }),
            "player: character.jump_speed must be 2 to 50, got 1");
  EXPECT_EQ(Error([](v1::Scene& s) { CharacterOf(s).set_step_height(0.95); }),
            "player: character.step_height must be 0 to 0.9, got 0.95");
  EXPECT_EQ(Error([](v1::Scene& s) { CharacterOf(s).set_max_slope(1.5); }),
            "player: character.max_slope must be 0.1 to 1.3, got 1.5");
  EXPECT_EQ(Error([](v1::Scene& s) { CharacterOf(s).set_push_mass(kNan); }),
            "player: character.push_mass must be a finite number, got nan");
}

}  // namespace
}  // namespace tessera
