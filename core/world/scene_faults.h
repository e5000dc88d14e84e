// A sound scene, and the error that it gives once something in it is wrong.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <string>

#include "absl/strings/str_cat.h"
#include "core/world/scene_io.h"

namespace tessera::scene_faults {

inline constexpr char kFile[] = "scenes/x.textproto";

// A sound scene: bodies[0] is ground, bodies[1] a crate, bodies[2] a ball; templates, a joint, a player.
inline v1::Scene Sound() {
  auto scene = ParseScene(R"(
    name: "x"
    bounds { min { x: -10 y: -10 z: -10 } max { x: 10 y: 10 z: 10 } }
    materials { name: "wood" friction: 0.5 }
    bodies { id: 1 motion: MOTION_STATIC shape { plane { normal { y: 1 } } } }
    bodies { id: 40 name: "crate" mass: 1 material: "wood" shape { box { half_extents { x: 1 y: 1 z: 1 } } } }
    bodies { id: 41 mass: 1 shape { sphere { radius: 1 } } pose { position { y: 5 } } }
    joints { id: 1 body_a: 40 body_b: 41 point {} }
    scatters {
      first_id: 100 count: 9 spacing: 2 jitter: 1
      area { min { x: -8 y: 1 z: -8 } max { x: 8 y: 2 z: 8 } }
      templates { mass: 1 shape { sphere { radius: 0.1 } } }
    }
    fields { vortex { radius: 5 angular_velocity: 1 gain: 1 } }
    fields { uniform { bounds { max { x: 1 y: 1 z: 1 } } acceleration { y: 1 } } }
    player { body { mass: 80 shape { sphere { radius: 1 } } } spawn_points { y: 1 } max_force: 1 max_speed: 1 }
  )",
                          kFile);
  EXPECT_TRUE(scene.ok()) << scene.status();
  return *scene;
}

// The error of the sound scene after `change`, without the file name that it must begin with.
template <class Change>
std::string Error(Change change) {
  v1::Scene scene = Sound();
  change(scene);
  const auto resolved = ResolveScene(scene, kFile);
  EXPECT_EQ(resolved.status().code(), absl::StatusCode::kInvalidArgument);
  const std::string message(resolved.status().message());
  EXPECT_EQ(message.find('\n'), std::string::npos);
  const std::string start = absl::StrCat(kFile, ": ");
  EXPECT_EQ(message.substr(0, start.size()), start);
  return message.substr(std::min(start.size(), message.size()));
}

// The error after a change of bodies[1], the crate, without its place.
template <class Change>
std::string CrateError(Change change) {
  const std::string place = "bodies[1] (id 40 \"crate\"): ";
  const std::string error = Error([&](v1::Scene& scene) { change(*scene.mutable_bodies(1)); });
  EXPECT_EQ(error.substr(0, place.size()), place);
  return error.substr(std::min(place.size(), error.size()));
}

// The error when bodies[0], which is static, has the shape that is given as text.
inline std::string ShapeError(const std::string& shape) {
  const auto parsed = ParseScene("bodies { shape { " + shape + " } }", kFile);
  EXPECT_TRUE(parsed.ok()) << parsed.status();
  const std::string place = "bodies[0] (id 1): ";
  const std::string error =
      Error([&](v1::Scene& scene) { *scene.mutable_bodies(0)->mutable_shape() = parsed->bodies(0).shape(); });
  EXPECT_EQ(error.substr(0, place.size()), place);
  return error.substr(std::min(place.size(), error.size()));
}

inline std::string JointError(const std::string& fields) {
  std::string ends;
  if (fields.find("body_a") == std::string::npos) ends += "body_a: 40 ";
  if (fields.find("body_b") == std::string::npos) ends += "body_b: 41 ";
  const auto parsed = ParseScene("joints { id: 1 " + ends + fields + " }", kFile);
  EXPECT_TRUE(parsed.ok()) << parsed.status();
  const std::string place = "joints[0] (id 1): ";
  const std::string error = Error([&](v1::Scene& scene) { *scene.mutable_joints(0) = parsed->joints(0); });
  EXPECT_EQ(error.substr(0, place.size()), place);
  return error.substr(std::min(place.size(), error.size()));
}

inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
inline constexpr double kInf = std::numeric_limits<double>::infinity();

}  // namespace tessera::scene_faults
