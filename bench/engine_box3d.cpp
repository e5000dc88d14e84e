// Box3D as its samples set it up: its default world, 4 substeps a step unless told otherwise, and as many workers as
// the configuration has threads. A body's frame is that of its mass; shapes hang in it by offsets.
//
// It has no plane. A plane is a box here whose upper face lies in it.
#include <box3d/box3d.h>

#include <memory>
#include <unordered_map>
#include <vector>

#include "bench/engine_parts.h"

namespace tessera::bench {
namespace {

constexpr int kDefaultSubsteps = 4;                                 // as in all of its samples
constexpr double kGroundHalfWidth_m = 500, kGroundHalfDepth_m = 5;  // floats resolve .03 mm that far out

b3Vec3 ToBox3d(Vec3d v) { return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)}; }
b3Vec3 ToBox3d(Vec3f v) { return {v.x, v.y, v.z}; }
b3Quat ToBox3d(Quatd q) {
  q = Normalized(q);
  return {ToBox3d(Vec3d{q.x, q.y, q.z}), static_cast<float>(q.w)};
}
b3Transform ToBox3d(const Pose& pose) { return {ToBox3d(pose.position), ToBox3d(pose.orientation)}; }
b3Pos PlaceOf(Vec3d v) { return b3ToPos(ToBox3d(v)); }
Vec3f FromBox3d(b3Vec3 v) { return {v.x, v.y, v.z}; }

struct HullDeleter {
  void operator()(b3HullData* hull) const { b3DestroyHull(hull); }
};
struct MeshDeleter {
  void operator()(b3MeshData* mesh) const { b3DestroyMesh(mesh); }
};

class Box3dEngine : public Engine {
 public:
  explicit Box3dEngine(const EngineConfig& config) : config_(config) {
    b3WorldDef def = b3DefaultWorldDef();
    def.enableSleep = config.sleep;
    def.workerCount = static_cast<std::uint32_t>(config.threads);
    world_ = b3CreateWorld(&def);
  }
  ~Box3dEngine() override { b3DestroyWorld(world_); }
  Box3dEngine(const Box3dEngine&) = delete;
  Box3dEngine& operator=(const Box3dEngine&) = delete;
  std::string_view name() const override { return EngineName(EngineKind::kBox3d); }

  absl::Status Load(const Scene& scene) override;
  void Step(double dt_s) override;
  BodyState StateOf(BodyId id) const override;
  void SetState(BodyId id, const BodyState& state) override;
  void ApplyForce(BodyId id, Vec3f force_n, Vec3f torque_nm) override {
    b3Body_ApplyForceToCenter(bodies_.at(id).box3d, ToBox3d(force_n), true);
    b3Body_ApplyTorque(bodies_.at(id).box3d, ToBox3d(torque_nm), true);
  }

 private:
  struct Body {
    BodyDef def;
    MassFrame mass;
    b3BodyId box3d;
  };
  absl::Status AddBody(const BodyDef& def);
  // `pose`: of the shape in its body.
  absl::Status AddShape(const Body& body, const Shape& shape, const Pose& pose);
  void AddHull(const Body& body, const b3ShapeDef& def, const ConvexHullShape& hull, const Pose& pose);
  void AddMesh(const Body& body, const b3ShapeDef& def, const TriangleMeshShape& mesh);
  absl::Status AddJoint(const JointDef& def);
  b3BodyId Anchor();

  EngineConfig config_;
  b3WorldId world_{};
  b3BodyId anchor_ = b3_nullBodyId;  // the world's side of joints
  std::vector<std::unique_ptr<b3MeshData, MeshDeleter>> meshes_;
  std::unordered_map<BodyId, Body> bodies_;
};

absl::Status Box3dEngine::Load(const Scene& scene) {
  if (!scene.fields.empty()) return Lacking(name(), "fields");
  b3World_SetGravity(world_, ToBox3d(scene.gravity_m_s2));
  for (const BodyDef& def : scene.bodies) {
    if (absl::Status status = AddBody(def); !status.ok()) return status;
  }
  for (const JointDef& def : scene.joints) {
    if (absl::Status status = AddJoint(def); !status.ok()) return status;
  }
  return absl::OkStatus();
}

absl::Status Box3dEngine::AddBody(const BodyDef& def) {
  if (def.linear_damping > 0 || def.angular_damping > 0) return Lacking(name(), "damping by shares");
  if (def.trigger) return Lacking(name(), "triggers");
  if (def.material.rolling_friction > 0 || def.material.spinning_friction > 0) {
    return Lacking(name(), "rolling and spinning friction as lengths");
  }
  const bool dynamic = def.motion == Motion::kDynamic;
  Body body{.def = def, .mass = MassFrameOf(def), .box3d = b3_nullBodyId};
  b3BodyDef made = b3DefaultBodyDef();
  made.type = dynamic ? b3_dynamicBody : b3_staticBody;
  made.position = PlaceOf(def.initial.position);
  made.rotation = ToBox3d(Normalized(def.initial.orientation) * body.mass.axes);
  made.gravityScale = static_cast<float>(def.gravity_scale);
  made.enableSleep = config_.sleep && def.may_sleep;
  body.box3d = b3CreateBody(world_, &made);
  const Pose shape = body.mass.ShapePose();
  if (const auto* compound = std::get_if<CompoundShape>(&def.shape->form)) {
    for (const CompoundChild& child : compound->children) {
      if (absl::Status status = AddShape(body, *child.shape, Compose(shape, child.pose)); !status.ok()) return status;
    }
  } else if (absl::Status status = AddShape(body, *def.shape, shape); !status.ok()) {
    return status;
  }
  if (dynamic) {
    const b3Vec3 inertia = ToBox3d(body.mass.inertia_kg_m2);
    b3Body_SetMassData(
        body.box3d,
        {static_cast<float>(def.mass_kg), {0, 0, 0}, {{inertia.x, 0, 0}, {0, inertia.y, 0}, {0, 0, inertia.z}}});
  }
  bodies_.emplace(def.id, body);
  SetState(def.id, def.initial);
  return absl::OkStatus();
}

absl::Status Box3dEngine::AddShape(const Body& body, const Shape& shape, const Pose& pose) {
  b3ShapeDef def = b3DefaultShapeDef();
  def.baseMaterial.friction = static_cast<float>(body.def.material.friction);
  def.baseMaterial.restitution = static_cast<float>(body.def.material.restitution);
  def.updateBodyMass = false;
  if (const auto* box = std::get_if<BoxShape>(&shape.form)) {
    const b3Vec3 half = ToBox3d(box->half_extents_m);
    const b3BoxHull hull = b3MakeTransformedBoxHull(half.x, half.y, half.z, ToBox3d(pose));
    b3CreateHullShape(body.box3d, &def, &hull.base);
  } else if (const auto* ball = std::get_if<SphereShape>(&shape.form)) {
    const b3Sphere sphere{ToBox3d(pose.position), static_cast<float>(ball->radius_m)};
    b3CreateSphereShape(body.box3d, &def, &sphere);
  } else if (const auto* rod = std::get_if<CapsuleShape>(&shape.form)) {
    const Vec3d half = Rotate(pose.orientation, {0, rod->half_height_m, 0});
    const b3Capsule capsule{ToBox3d(pose.position - half), ToBox3d(pose.position + half),
                            static_cast<float>(rod->radius_m)};
    b3CreateCapsuleShape(body.box3d, &def, &capsule);
  } else if (const auto* plane = std::get_if<PlaneShape>(&shape.form)) {
    const Pose below =
        Compose(pose, {plane->normal * (plane->offset_m - kGroundHalfDepth_m), TurnFromZ(plane->normal)});
    const auto wide = static_cast<float>(kGroundHalfWidth_m), deep = static_cast<float>(kGroundHalfDepth_m);
    const b3BoxHull hull = b3MakeTransformedBoxHull(wide, wide, deep, ToBox3d(below));
    b3CreateHullShape(body.box3d, &def, &hull.base);
  } else if (const auto* hull = std::get_if<ConvexHullShape>(&shape.form)) {
    AddHull(body, def, *hull, pose);
  } else if (const auto* mesh = std::get_if<TriangleMeshShape>(&shape.form)) {
    AddMesh(body, def, *mesh);
  } else {
    return Lacking(name(), "cylinders, cones and height fields");
  }
  return absl::OkStatus();
}

void Box3dEngine::AddHull(const Body& body, const b3ShapeDef& def, const ConvexHullShape& hull, const Pose& pose) {
  std::vector<b3Vec3> points;
  for (const Vec3f& p : hull.points) points.push_back(ToBox3d(pose.position + Rotate(pose.orientation, Vec3d(p))));
  const auto count = static_cast<int>(points.size());
  const std::unique_ptr<b3HullData, HullDeleter> made(b3CreateHull(points.data(), count, count));
  b3CreateHullShape(body.box3d, &def, made.get());
}

// Meshes are static, so the mesh's frame is its body's.
void Box3dEngine::AddMesh(const Body& body, const b3ShapeDef& def, const TriangleMeshShape& mesh) {
  std::vector<b3Vec3> vertices;
  for (const Vec3f& vertex : mesh.vertices) vertices.push_back(ToBox3d(vertex));
  std::vector<std::int32_t> indices;
  for (const auto& triangle : mesh.triangles) {
    for (const auto index : triangle) indices.push_back(static_cast<std::int32_t>(index));
  }
  b3MeshDef made{};
  made.vertices = vertices.data();
  made.vertexCount = static_cast<int>(vertices.size());
  made.indices = indices.data();
  made.triangleCount = static_cast<int>(mesh.triangles.size());
  made.identifyEdges = true;
  meshes_.emplace_back(b3CreateMesh(&made, nullptr, 0));
  b3CreateMeshShape(body.box3d, &def, meshes_.back().get(), {1, 1, 1});
}

b3BodyId Box3dEngine::Anchor() {
  if (B3_IS_NULL(anchor_)) {
    const b3BodyDef def = b3DefaultBodyDef();
    anchor_ = b3CreateBody(world_, &def);
  }
  return anchor_;
}

absl::Status Box3dEngine::AddJoint(const JointDef& def) {
  if (!std::holds_alternative<PointJoint>(def.kind)) return Lacking(name(), "joints other than point joints here");
  const Body& a = bodies_.at(def.body_a);
  b3SphericalJointDef joint = b3DefaultSphericalJointDef();
  joint.base.bodyIdA = a.box3d;
  joint.base.localFrameA = ToBox3d(JointFrame(a.mass, def.frame_a));
  joint.base.collideConnected = def.bodies_collide;
  if (def.body_b != BodyId()) {
    const Body& b = bodies_.at(def.body_b);
    joint.base.bodyIdB = b.box3d;
    joint.base.localFrameB = ToBox3d(JointFrame(b.mass, def.frame_b));
  } else {
    joint.base.bodyIdB = Anchor();
    joint.base.localFrameB = ToBox3d(def.frame_b);
  }
  b3CreateSphericalJoint(world_, &joint);
  return absl::OkStatus();
}

void Box3dEngine::Step(double dt_s) {
  const int substeps = config_.substeps > 0 ? config_.substeps : kDefaultSubsteps;
  b3World_Step(world_, static_cast<float>(dt_s), substeps);
}

void Box3dEngine::SetState(BodyId id, const BodyState& state) {
  const Body& body = bodies_.at(id);
  if (body.def.motion != Motion::kDynamic) return;
  b3Body_SetTransform(body.box3d, PlaceOf(state.position), ToBox3d(Normalized(state.orientation) * body.mass.axes));
  b3Body_SetLinearVelocity(body.box3d, ToBox3d(state.linear_velocity));
  b3Body_SetAngularVelocity(body.box3d, ToBox3d(state.angular_velocity));
  b3Body_SetAwake(body.box3d, !(state.asleep && config_.sleep && body.def.may_sleep));
}

BodyState Box3dEngine::StateOf(BodyId id) const {
  const Body& body = bodies_.at(id);
  if (body.def.motion != Motion::kDynamic) return body.def.initial;
  const b3Quat q = b3Body_GetRotation(body.box3d);
  BodyState state;
  state.position = Vec3d(FromBox3d(b3ToVec3(b3Body_GetPosition(body.box3d))));
  state.orientation = Normalized(Quatd{q.v.x, q.v.y, q.v.z, q.s} * Conjugate(body.mass.axes));
  state.linear_velocity = FromBox3d(b3Body_GetLinearVelocity(body.box3d));
  state.angular_velocity = FromBox3d(b3Body_GetAngularVelocity(body.box3d));
  state.asleep = !b3Body_IsAwake(body.box3d);
  return state;
}

}  // namespace

std::unique_ptr<Engine> MakeBox3dEngine(const EngineConfig& config) { return std::make_unique<Box3dEngine>(config); }

}  // namespace tessera::bench
