// Scene: a world to run, checked and resolved. It is plain data that the rest of core works on.
//
// It comes from `tessera.v1.Scene` (textproto, JSON or wire) through core/world/scene_load.h, which checks every field
// and expands defaults, materials by name and scatters. Nothing here needs another check.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/world/bounds.h"
#include "core/world/ids.h"
#include "core/world/math.h"
#include "core/world/properties.h"

namespace tessera {

// --- Shapes ----------------------------------------------------------------------------------------------------------
// Each has coordinates of its own, in which the frames of joints are given too. The position of a static body is their
// origin. The position of a dynamic body is its centre of mass at uniform density: the same point except for a cone (a
// quarter of its height above the base), a hull and a compound, see `physics::CenterOfMass`.

struct Shape;
using ShapePtr = std::shared_ptr<const Shape>;  // shared by all bodies that look alike

struct BoxShape {
  Vec3d half_extents_m;
};
struct SphereShape {
  double radius_m = 0;
};
struct CapsuleShape {  // along local y; total height 2 * (half_height_m + radius_m)
  double radius_m = 0, half_height_m = 0;
};
struct CylinderShape {  // along local y
  double radius_m = 0, half_height_m = 0;
};
struct ConeShape {  // along local y, apex up; origin halfway up its height
  double radius_m = 0, height_m = 0;
};
struct ConvexHullShape {
  std::vector<Vec3f> points;  // 4 to kMaxHullPoints, not all in one plane
};
struct CompoundChild {
  Pose pose;
  ShapePtr shape;  // convex, never itself a compound, mesh, height field or plane
};
struct CompoundShape {
  std::vector<CompoundChild> children;
};
struct TriangleMeshShape {  // static bodies only; counter-clockwise is outward
  std::vector<Vec3f> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};
struct HeightFieldShape {  // static only; height at column x, row z is heights_m[z * columns + x]; centred in x and z,
                           // y as given
  std::uint32_t columns = 0, rows = 0;
  double spacing_m = 0;
  std::vector<float> heights_m;
};
struct PlaneShape {  // static only; solid below dot(normal, p) = offset_m
  Vec3d normal{0, 1, 0};
  double offset_m = 0;
};

// A mesh of a glTF file, which is drawn in place of a shape by whoever has the file. Physics never looks at it.
struct Visual {
  std::string sha256;      // hash of the file: 64 lower-case hexadecimal digits
  std::uint32_t mesh = 0;  // its place in the file's meshes
  Pose pose;               // in the shape's coordinates
  Vec3d scale{1, 1, 1};    // along the mesh's own axes, never 0; negative: mirrored
};

struct Shape {
  std::variant<BoxShape, SphereShape, CapsuleShape, CylinderShape, ConeShape, ConvexHullShape, CompoundShape,
               TriangleMeshShape, HeightFieldShape, PlaneShape>
      form;
  std::vector<Visual> visuals{};  // not of a compound's children
};

// --- Bodies ----------------------------------------------------------------------------------------------------------

struct Material {
  double friction = 0.5;         // Coulomb; a pair uses the geometric mean of its two
  double rolling_friction = 0;   // m; a pair uses the larger
  double spinning_friction = 0;  // m; a pair uses the larger
  double restitution = 0;        // 0 to 1; a pair uses the larger of its two
};

enum class Motion : std::uint8_t { kStatic, kDynamic };

// The collision layer of a body. `collides` is symmetric over the layers of a scene, so one of two bodies answers for
// both.
struct CollisionLayer {
  std::uint8_t index = 0;        // place in the scene's layers, below kMaxLayers
  std::uint32_t collides = ~0u;  // bit i: with the bodies of layer i
  bool CollidesWith(const CollisionLayer& other) const { return (collides >> other.index & 1) != 0; }
  friend bool operator==(const CollisionLayer&, const CollisionLayer&) = default;
};

// The part of a body that changes from tick to tick: an owner sends all of it, and a handover must keep all of it.
struct BodyState {
  Vec3d position;          // centre of mass, world space, m
  Quatd orientation;       // unit; rounded to float every tick, a spinning body would be .3 rad off after 20 s
  Vec3f linear_velocity;   // m/s
  Vec3f angular_velocity;  // rad/s, world frame
  // Free flight conserves it; kg m^2/s, world frame. It counts only where angular_velocity is to the bit the one that
  // follows from it; otherwise angular_velocity counts. So a scene, which sets angular_velocity alone, may leave it 0.
  Vec3f angular_momentum{};
  float still_s = 0;  // time for which it has been slow enough to sleep: a handover restarts no wait
  bool asleep = false;
  friend bool operator==(const BodyState&, const BodyState&) = default;
};

// Where a kinematic body is at every tick: a function of time alone (core/physics/body_path.h). Points are passed at
// their times along a smooth curve, and turned the shortest way; `spin_rad_s` turns the body about its centre of mass
// besides.
struct PathPoint {
  double time_s = 0;  // the first one's is 0
  Pose pose;
};
enum class PathRepeat : std::uint8_t {
  kLoop,      // from the last point, which is the first one again, on as from the first
  kPingPong,  // back the same way, and so on
  kOnce,      // it stays at the last point
};
struct BodyPath {
  std::vector<PathPoint> points;  // ascending by time; one alone: it turns in its place
  PathRepeat repeat = PathRepeat::kLoop;
  Vec3d spin_rad_s;
};

// The part of a body that never changes.
struct BodyDef {
  BodyId id;
  std::string name;  // may be empty
  ShapePtr shape;
  // Static bodies are in every region, and nobody owns them; dynamic ones have an owner.
  Motion motion = Motion::kDynamic;
  // Nothing pushes it, and it pushes what it meets. With a path it counts as static, as every region knows where it is;
  // without one a game moves it, and it counts as dynamic, but has no mass and no gravity.
  bool kinematic = false;
  std::shared_ptr<const BodyPath> path;
  double mass_kg = 1;                  // > 0 when dynamic; 0 when static
  std::optional<Vec3d> inertia_kg_m2;  // principal, about local x, y, z; from the shape when absent
  Material material;
  double linear_damping = 0, angular_damping = 0;  // share of velocity lost a second, 0 to 1
  double gravity_scale = 1;
  bool trigger = false;  // reports overlaps and pushes nothing
  bool may_sleep = true;
  CollisionLayer layer;
  std::uint16_t kind = 0;  // place in the scene's kinds: whose callbacks of a game are called for it
  PropertySet properties;  // those that differ from the scene's declaration
  Visibility visible_to = Visibility::kEveryone;  // unless a game says otherwise; not kPlayer
  BodyState initial;
};

// --- Joints ----------------------------------------------------------------------------------------------------------
// Frames are in the coordinates of each body's shape. The joint's own axes are those of frame_a, and positions and
// velocities along them those of body_b against body_a. In a joint to the world, the world takes the part of body_a.

struct Limit {  // lower > upper: free
  double lower = 1, upper = -1;
  bool free() const { return lower > upper; }
};
struct Motor {  // off while max_force is 0; N or N m, m/s or rad/s
  double target_velocity = 0, max_force = 0;
};
struct Spring {  // off while stiffness is 0; N/m or N m/rad, and N s/m or N m s/rad
  double stiffness = 0, damping = 0, rest = 0;
};

struct PointJoint {};  // origins of both frames coincide
struct FixedJoint {};  // frames coincide
struct HingeJoint {    // turns about the frames' z
  Limit limit_rad;
  Motor motor;
};
struct SliderJoint {  // slides along the frames' x
  Limit limit_m;
  Motor motor;
};
struct ConeTwistJoint {  // twists about the frames' x; half angles of the swing cone about y and z
  double swing_y_rad = 0, swing_z_rad = 0, twist_rad = 0;
};
struct SixDofAxis {
  Limit limit{0, 0};  // locked unless said otherwise
  Motor motor;
  Spring spring;
};
struct SixDofJoint {  // linear x, y, z (m), then angular x, y, z (rad)
  std::array<SixDofAxis, 6> axes;
};
struct UniversalJoint {  // turns about frame_a's z and frame_b's y
  Limit limit_a_rad, limit_b_rad;
};
struct Hinge2Joint {  // a wheel: steers about frame z, turns about frame x, sprung along z
  Limit steering_rad;
  Spring suspension;
  Motor drive;
};
struct GearJoint {  // angular velocity about a's frame z times ratio equals minus that of b about b's frame z
  double ratio = 1;
};

struct JointDef {
  JointId id;
  BodyId body_a, body_b;  // body_b may be BodyId(): fixed to the world (frame_b is then in world space)
  Pose frame_a, frame_b;
  bool bodies_collide = false;
  std::variant<PointJoint, FixedJoint, HingeJoint, SliderJoint, ConeTwistJoint, SixDofJoint, UniversalJoint,
               Hinge2Joint, GearJoint>
      kind;
};

// --- Fields ----------------------------------------------------------------------------------------------------------
// Accelerations by place. They are functions of a body's state alone, so both sides of a border compute the same.

// Drags bodies toward turning about a vertical axis: a = gain_per_s * (omega x r - v), horizontal part only, within
// radius.
struct VortexField {
  Vec3d center;
  double radius_m = 0;
  double angular_velocity_rad_s = 0;  // about +y
  double gain_per_s = 0;
};
// A constant acceleration inside a box, e.g. wind or a lift shaft.
struct UniformField {
  Aabb bounds;
  Vec3d acceleration_m_s2;
};
using Field = std::variant<VortexField, UniformField>;

// --- The scene -------------------------------------------------------------------------------------------------------

// How an engine's character moves a player's body, a capsule that stays upright (core/physics/character.h). Speeds are
// in m/s.
struct CharacterRules {
  double walk_speed_m_s = 4, run_speed_m_s = 4;  // the second while button kRunButton is held
  double acceleration_m_s2 = 40;                 // on the ground, to speed up and to brake
  double air_control = 0.2;                      // share of that acceleration in the air
  double jump_speed_m_s = 0;                     // up, while button kJumpButton is held; 0: it cannot jump
  double step_height_m = 0.3;
  double max_slope_rad = 0.8;  // it stands and walks on ground up to this slope, and slides on steeper ground
  double push_mass_kg = 0;     // it does not push heavier bodies than this
};
inline constexpr std::uint32_t kJumpButton = 1, kRunButton = 2;  // buttons 0 and 1

// The body of a player in this scene, and the limits of a client's input.
struct PlayerRules {
  BodyDef body;                     // template: id and initial position come with the player
  std::vector<Vec3d> spawn_points;  // player n starts at spawn_points[(n - 1) % size]
  double max_force_n = 0;           // an input that asks for more is scaled down to it
  // The part of the force against gravity is cut down to this: less than the weight, and nobody flies.
  double max_force_up_n = std::numeric_limits<double>::infinity();
  Vec3d up{0, 1, 0};  // against the body's gravity, unit
  // The input's force fades to 0 along the direction in which the body is this fast; a torque is limited by the force
  // and the speed that it means at the body's surface.
  double max_speed_m_s = 0;
  // Where given, inputs steer a character, and their force and torque count for nothing. The body is then a capsule
  // without friction that nothing tilts.
  std::optional<CharacterRules> character;
};

// The part of the world that clients see, and its cost.
struct ViewRules {
  double radius_m = 0;             // around the own body, in x and z; 0: all of the world
  double bytes_per_s = 1'250'000;  // to one client, from all regions together, overhead of datagrams included
};

// A thing that a game may make while the world runs: one body, or several that joints connect. Poses are about the
// place where it is made, and velocities along its axes.
struct Prefab {
  std::string name;
  std::vector<BodyDef> bodies;   // dynamic; ids are 1, 2 and so on
  std::vector<JointDef> joints;  // between them; ids are 1, 2 and so on
};

struct Scene {
  std::string name;
  Aabb bounds;  // the world; bodies that leave it belong to the nearest cell
  Vec3d gravity_m_s2{0, -9.81, 0};
  std::uint32_t tick_rate_hz = 60;
  std::vector<BodyDef> bodies;   // ascending by id
  std::vector<JointDef> joints;  // ascending by id
  std::vector<Field> fields;
  std::optional<PlayerRules> player;
  ViewRules view;
  std::vector<PropertyDef> properties;           // for bodies
  std::vector<PropertyDef> instance_properties;  // for the world as a whole, for its game
  std::string team_property;                     // empty: there are no teams
  std::vector<std::string> kinds{""};            // for bodies; the first is that of those without one
  std::vector<std::string> layers{"default"};  // for bodies, at most kMaxLayers; the first is that of those without one
  std::vector<Prefab> prefabs;

  Rect ground() const { return {bounds.min.x, bounds.min.z, bounds.max.x, bounds.max.z}; }
};

}  // namespace tessera
