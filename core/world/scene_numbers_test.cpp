// Makes every number of a scene absurd in turn: the scene is refused, and the error names the field.
#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <set>
#include <string>

#include "core/world/scene_io.h"

namespace tessera {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;

// Holds every field of scene.proto that is a number.
constexpr char kEverything[] = R"(
  name: "everything"
  bounds { min { x: -100 y: -100 z: -100 } max { x: 100 y: 100 z: 100 } }
  gravity { x: 0 y: -10 z: 0 }
  materials { name: "wood" friction: 0.5 rolling_friction: 0.1 spinning_friction: 0.1 restitution: 0.5 }
  bodies { id: 1 motion: MOTION_STATIC shape { plane { normal { y: 1 } offset: 0 } } }
  bodies {
    id: 2 motion: MOTION_STATIC
    shape { mesh { vertices {} vertices { x: 1 } vertices { z: 1 } indices: [0, 2, 1] } }
  }
  bodies {
    id: 3 motion: MOTION_STATIC
    shape { height_field { columns: 2 rows: 2 spacing: 1 heights: [0, 1, 0, 1] } }
  }
  bodies {
    id: 4 mass: 1 inertia { x: 1 y: 1 z: 1 } material: "wood" shape { box { half_extents { x: 1 y: 1 z: 1 } } }
    pose { position { x: 1 y: 2 z: 3 } orientation { x: 0 y: 0.6 z: 0 w: 0.8 } }
    linear_velocity { x: 1 } angular_velocity { x: 1 } linear_damping: 0.1 angular_damping: 0.1 gravity_scale: 0.5
  }
  bodies { id: 5 mass: 1 shape { sphere { radius: 1 } } }
  bodies { id: 6 mass: 1 shape { capsule { radius: 1 half_height: 1 } } }
  bodies { id: 7 mass: 1 shape { cylinder { radius: 1 half_height: 1 } } }
  bodies { id: 8 mass: 1 shape { cone { radius: 1 height: 1 } } }
  bodies { id: 9 mass: 1 shape { hull { points {} points { x: 1 } points { y: 1 } points { z: 1 } } } }
  bodies {
    id: 10 mass: 1
    shape { compound { children { pose { position {} orientation { w: 1 } } shape { sphere { radius: 0.7 } } } } }
  }
  bodies {
    id: 11 shape { box { half_extents { x: 1 y: 1 z: 1 } } }
    kinematic { path { points { position { x: 1 } time: 2 } points { position { x: 2 } speed: 1 } repeat: REPEAT_PING_PONG spin { y: 1 } } }
  }
  joints {
    id: 1 body_a: 4 body_b: 5 frame_a { position {} orientation { w: 1 } } frame_b { position {} orientation { w: 1 } }
    hinge { limit { lower: -1 upper: 1 } motor { target_velocity: 1 max_force: 1 } }
  }
  joints {
    id: 2 body_a: 5 frame_b { position { y: 50 } }
    slider { limit { lower: -1 upper: 1 } motor { target_velocity: 1 max_force: 1 } }
  }
  joints { id: 3 body_a: 5 body_b: 6 cone_twist { swing_y: 1 swing_z: 1 twist: 1 } }
  joints {
    id: 4 body_a: 6 body_b: 7
    six_dof {
      axes { limit { lower: -1 upper: 1 } motor { target_velocity: 1 } spring { stiffness: 1 damping: 1 rest: 1 } }
      axes {} axes {} axes {} axes {}
      axes { limit { lower: -1 upper: 1 } motor { target_velocity: 1 } spring { stiffness: 1 damping: 1 rest: 1 } }
    }
  }
  joints {
    id: 5 body_a: 7 body_b: 8 universal { limit_a { lower: -1 upper: 1 } limit_b { lower: -1 upper: 1 } }
  }
  joints {
    id: 6 body_a: 8 body_b: 9
    hinge2 {
      steering { lower: -1 upper: 1 } suspension { stiffness: 1 damping: 1 rest: 1 }
      drive { target_velocity: 1 max_force: 1 }
    }
  }
  joints { id: 7 body_a: 9 body_b: 10 gear { ratio: 1 } }
  scatters {
    first_id: 100 count: 9 spacing: 2 jitter: 1
    area { min { x: -8 y: 1 z: -8 } max { x: 8 y: 2 z: 8 } }
    templates { mass: 1 shape { sphere { radius: 0.1 } } }
  }
  fields { vortex { center { x: 1 } radius: 5 angular_velocity: 1 gain: 1 } }
  fields { uniform { bounds { max { x: 1 y: 1 z: 1 } } acceleration { y: 1 } } }
  properties { name: "health" number: 100 }
  properties { name: "speed" real: 1.5 }
  view { radius: 50 bytes_per_second: 100000 }
  player { body { mass: 80 shape { sphere { radius: 1 } } } spawn_points { y: 1 } max_force: 1 max_speed: 1 max_force_up: 1 }
)";

// The same with players that walk, which are given no forces.
std::string WithWalkers() {
  const std::string everything = kEverything;
  return everything.substr(0, everything.find("  player {")) + R"(
  player {
    body { mass: 80 shape { capsule { radius: 0.3 half_height: 0.6 } } }
    spawn_points { y: 1 }
    character { walk_speed: 4 run_speed: 7 acceleration: 40 air_control: 0.2 jump_speed: 4 step_height: 0.3 max_slope: 0.8 push_mass: 50 }
  }
)";
}

bool IsNumber(const FieldDescriptor& field) {
  return field.cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE || field.cpp_type() == FieldDescriptor::CPPTYPE_FLOAT;
}

void Set(Message& message, const FieldDescriptor& field, double value) {
  const Reflection& reflection = *message.GetReflection();
  if (field.is_repeated()) return reflection.SetRepeatedFloat(&message, &field, 0, static_cast<float>(value));
  reflection.SetDouble(&message, &field, value);
}

// Numbers of the message and of every message in it. `name`: the field that holds the message.
void ForEachNumber(Message& message, const std::string& name,
                   const std::function<void(Message&, const FieldDescriptor&, const std::string& name)>& visit) {
  const Descriptor& type = *message.GetDescriptor();
  const Reflection& reflection = *message.GetReflection();
  for (int i = 0; i < type.field_count(); ++i) {
    const FieldDescriptor& field = *type.field(i);
    const bool component = type.name() == "Vec3" || type.name() == "Quat";
    if (IsNumber(field)) {
      const bool in_another_kind = field.real_containing_oneof() != nullptr && !reflection.HasField(message, &field);
      if (!in_another_kind) visit(message, field, component ? name : field.name());
    } else if (field.cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE) {
      continue;
    } else if (field.is_repeated()) {
      for (int k = 0; k < reflection.FieldSize(message, &field); ++k) {
        ForEachNumber(*reflection.MutableRepeatedMessage(&message, &field, k), field.name(), visit);
      }
    } else if (reflection.HasField(message, &field)) {
      ForEachNumber(*reflection.MutableMessage(&message, &field), field.name(), visit);
    }
  }
}

void ExpectAbsurdNumbersToBeRefused(const std::string& text) {
  auto scene = ParseScene(text, "x.textproto");
  ASSERT_TRUE(scene.ok()) << scene.status();
  ASSERT_TRUE(ResolveScene(*scene, "x.textproto").ok()) << ResolveScene(*scene, "x.textproto").status();
  ForEachNumber(*scene, "", [&](Message& message, const FieldDescriptor& field, const std::string& name) {
    const std::unique_ptr<Message> sound(message.New());
    sound->CopyFrom(message);
    for (const double bad : {std::nan(""), HUGE_VAL, -HUGE_VAL, 1e30, -1e30}) {
      Set(message, field, bad);
      const absl::Status status = ResolveScene(*scene, "x.textproto").status();
      EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << field.full_name() << ' ' << bad;
      EXPECT_NE(std::string(status.message()).find(name), std::string::npos)
          << field.full_name() << ' ' << bad << ": " << status;
    }
    message.CopyFrom(*sound);
  });
}

TEST(SceneNumbersTest, WhatIsAbsurdIsRefusedByName) {
  ExpectAbsurdNumbersToBeRefused(kEverything);
  ExpectAbsurdNumbersToBeRefused(WithWalkers());
}

void NumbersOf(const Descriptor& type, std::set<std::string>& names) {
  for (int i = 0; i < type.field_count(); ++i) {
    if (IsNumber(*type.field(i))) names.insert(type.field(i)->full_name());
  }
  for (int i = 0; i < type.nested_type_count(); ++i) NumbersOf(*type.nested_type(i), names);
}

// A field that is added to the format must be added to the test above, too.
TEST(SceneNumbersTest, NoneIsLeftOut) {
  std::set<std::string> all, seen;
  const auto& file = *v1::Scene::descriptor()->file();
  for (int i = 0; i < file.message_type_count(); ++i) NumbersOf(*file.message_type(i), all);
  for (const std::string& text : {std::string(kEverything), WithWalkers()}) {
    auto scene = ParseScene(text, "x.textproto");
    ASSERT_TRUE(scene.ok()) << scene.status();
    ForEachNumber(*scene, "",
                  [&](Message&, const FieldDescriptor& field, const std::string&) { seen.insert(field.full_name()); });
  }
  EXPECT_EQ(seen, all);
}

}  // namespace
}  // namespace tessera
