// ODE as its manual sets it up: hash space, contact joints made in the near callback, the default ERP and CFM, the
// iterative solver dWorldQuickStep (20 iterations) unless the direct one, dWorldStep, is asked for. A body's frame is
// that of its mass; shapes hang in it by offsets.
#include <ode/ode.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <unordered_map>
#include <vector>

#include "absl/status/statusor.h"
#include "bench/engine_parts.h"
#include "bench/hull_faces.h"

namespace tessera::bench {
namespace {

static_assert(sizeof(dReal) == sizeof(double), "Debian's ODE is in double precision");

constexpr int kMaxContacts = 16;  // per pair; a box on a plane has 4, on a mesh more

// ODE counts w first.
void ToOde(Quatd q, dQuaternion out) {
  q = Normalized(q);
  out[0] = q.w;
  out[1] = q.x;
  out[2] = q.y;
  out[3] = q.z;
}

// Bodies are made and freed with the library; it keeps a count of its own.
struct Library {
  Library() { dInitODE2(0); }
  ~Library() { dCloseODE(); }
};

class OdeEngine : public Engine {
 public:
  explicit OdeEngine(const EngineConfig& config)
      : config_(config), world_(dWorldCreate()), space_(dHashSpaceCreate(nullptr)), contacts_(dJointGroupCreate(0)) {
    if (config.iterations > 0) dWorldSetQuickStepNumIterations(world_, config.iterations);
    dWorldSetAutoDisableFlag(world_, config.sleep ? 1 : 0);
  }
  ~OdeEngine() override {
    dJointGroupDestroy(contacts_);
    dSpaceDestroy(space_);
    dWorldDestroy(world_);
    for (const dTriMeshDataID mesh : meshes_) dGeomTriMeshDataDestroy(mesh);
  }
  OdeEngine(const OdeEngine&) = delete;
  OdeEngine& operator=(const OdeEngine&) = delete;
  std::string_view name() const override { return EngineName(EngineKind::kOde); }

  absl::Status Load(const Scene& scene) override;
  void Step(double dt_s) override;
  BodyState StateOf(BodyId id) const override;
  void SetState(BodyId id, const BodyState& state) override;
  void ApplyForce(BodyId id, Vec3f force_n, Vec3f torque_nm) override { forces_.push_back({id, force_n, torque_nm}); }

 private:
  struct Body {
    BodyDef def;
    dBodyID ode = nullptr;  // none of a static one
    MassFrame mass;
    std::vector<dGeomID> geoms;
  };
  struct Force {
    BodyId on;
    Vec3f force, torque;
  };
  absl::Status AddBody(const BodyDef& def);
  absl::Status AddGeom(Body& body, const Shape& shape, const Pose& pose);
  absl::StatusOr<dGeomID> MakeGeom(const Shape& shape, Pose& pose);
  dGeomID MakeMesh(const TriangleMeshShape& mesh);
  dGeomID MakeConvex(const ConvexHullShape& hull);
  absl::Status AddJoint(const JointDef& def);
  void Push();
  static void Near(void* self, dGeomID a, dGeomID b);
  void Touch(dGeomID a, dGeomID b);

  Library library_;
  EngineConfig config_;
  dWorldID world_;
  dSpaceID space_;
  dJointGroupID contacts_;
  std::unordered_map<BodyId, std::unique_ptr<Body>> bodies_;
  std::vector<dTriMeshDataID> meshes_;
  std::vector<std::unique_ptr<std::vector<dReal>>> numbers_;  // arrays that ODE's shapes point into
  std::vector<std::unique_ptr<std::vector<unsigned>>> polygons_;
  std::vector<ShapePtr> shapes_;
  std::vector<Force> forces_;
  std::vector<const Body*> lighter_or_heavier_;  // those with a gravity of their own
  Vec3d gravity_;
};

absl::Status OdeEngine::Load(const Scene& scene) {
  if (!scene.fields.empty()) return Lacking(name(), "fields");
  gravity_ = scene.gravity_m_s2;
  dWorldSetGravity(world_, gravity_.x, gravity_.y, gravity_.z);
  for (const BodyDef& def : scene.bodies) {
    if (absl::Status status = AddBody(def); !status.ok()) return status;
  }
  for (const JointDef& def : scene.joints) {
    if (absl::Status status = AddJoint(def); !status.ok()) return status;
  }
  return absl::OkStatus();
}

absl::Status OdeEngine::AddBody(const BodyDef& def) {
  auto body = std::make_unique<Body>(Body{.def = def, .ode = nullptr, .mass = MassFrameOf(def), .geoms = {}});
  if (def.linear_damping > 0 || def.angular_damping > 0) return Lacking(name(), "damping by time rather than by step");
  if (def.motion == Motion::kDynamic) {
    body->ode = dBodyCreate(world_);
    dMass mass;
    const Vec3d inertia = body->mass.inertia_kg_m2;
    dMassSetParameters(&mass, def.mass_kg, 0, 0, 0, inertia.x, inertia.y, inertia.z, 0, 0, 0);
    dBodySetMass(body->ode, &mass);
    if (!def.may_sleep) dBodySetAutoDisableFlag(body->ode, 0);
    if (def.gravity_scale != 1) {
      dBodySetGravityMode(body->ode, 0);
      lighter_or_heavier_.push_back(body.get());
    }
  }
  const Pose shape = body->mass.ShapePose();
  if (const auto* compound = std::get_if<CompoundShape>(&def.shape->form)) {
    for (const CompoundChild& child : compound->children) {
      if (absl::Status status = AddGeom(*body, *child.shape, Compose(shape, child.pose)); !status.ok()) return status;
    }
  } else if (absl::Status status = AddGeom(*body, *def.shape, shape); !status.ok()) {
    return status;
  }
  shapes_.push_back(def.shape);
  bodies_.emplace(def.id, std::move(body));
  SetState(def.id, def.initial);
  return absl::OkStatus();
}

absl::Status OdeEngine::AddGeom(Body& body, const Shape& shape, const Pose& in_mass) {
  Pose pose = in_mass;
  const auto geom = MakeGeom(shape, pose);
  if (!geom.ok()) return geom.status();
  dSpaceAdd(space_, *geom);
  dGeomSetData(*geom, &body);
  body.geoms.push_back(*geom);
  dQuaternion q;
  if (body.ode != nullptr) {
    dGeomSetBody(*geom, body.ode);
    dGeomSetOffsetPosition(*geom, pose.position.x, pose.position.y, pose.position.z);
    ToOde(pose.orientation, q);
    dGeomSetOffsetQuaternion(*geom, q);
  } else if (dGeomGetClass(*geom) != dPlaneClass) {
    const Pose world = Compose({body.def.initial.position, Normalized(body.def.initial.orientation)}, pose);
    dGeomSetPosition(*geom, world.position.x, world.position.y, world.position.z);
    ToOde(world.orientation, q);
    dGeomSetQuaternion(*geom, q);
  } else {
    const auto& plane = std::get<PlaneShape>(shape.form);
    const Vec3d normal = Rotate(Normalized(body.def.initial.orientation), plane.normal);
    dGeomPlaneSetParams(*geom, normal.x, normal.y, normal.z, plane.offset_m + Dot(normal, body.def.initial.position));
  }
  return absl::OkStatus();
}

// ODE's long shapes lie along z; `pose` turns ours, along y, so.
absl::StatusOr<dGeomID> OdeEngine::MakeGeom(const Shape& shape, Pose& pose) {
  if (const auto* box = std::get_if<BoxShape>(&shape.form)) {
    const Vec3d h = box->half_extents_m;
    return dCreateBox(nullptr, 2 * h.x, 2 * h.y, 2 * h.z);
  }
  if (const auto* ball = std::get_if<SphereShape>(&shape.form)) return dCreateSphere(nullptr, ball->radius_m);
  if (const auto* capsule = std::get_if<CapsuleShape>(&shape.form)) {
    pose = Compose(pose, {{}, TurnFromZ({0, 1, 0})});
    return dCreateCapsule(nullptr, capsule->radius_m, 2 * capsule->half_height_m);
  }
  if (const auto* cylinder = std::get_if<CylinderShape>(&shape.form)) {
    pose = Compose(pose, {{}, TurnFromZ({0, 1, 0})});
    return dCreateCylinder(nullptr, cylinder->radius_m, 2 * cylinder->half_height_m);
  }
  if (const auto* plane = std::get_if<PlaneShape>(&shape.form)) {
    return dCreatePlane(nullptr, plane->normal.x, plane->normal.y, plane->normal.z, plane->offset_m);
  }
  if (const auto* mesh = std::get_if<TriangleMeshShape>(&shape.form)) return MakeMesh(*mesh);
  if (const auto* hull = std::get_if<ConvexHullShape>(&shape.form)) return MakeConvex(*hull);
  return Lacking(name(), "cones and height fields");
}

dGeomID OdeEngine::MakeMesh(const TriangleMeshShape& mesh) {
  const dTriMeshDataID data = dGeomTriMeshDataCreate();
  meshes_.push_back(data);
  dGeomTriMeshDataBuildSingle(data, mesh.vertices.data(), sizeof(Vec3f), static_cast<int>(mesh.vertices.size()),
                              mesh.triangles.data(), static_cast<int>(3 * mesh.triangles.size()),
                              sizeof(mesh.triangles[0]));
  return dCreateTriMesh(nullptr, data, nullptr, nullptr, nullptr);
}

dGeomID OdeEngine::MakeConvex(const ConvexHullShape& hull) {
  auto points = std::make_unique<std::vector<dReal>>(), planes = std::make_unique<std::vector<dReal>>();
  auto polygons = std::make_unique<std::vector<unsigned>>();
  for (const Vec3f& p : hull.points) points->insert(points->end(), {p.x, p.y, p.z});
  const std::vector<HullFace> faces = FacesOf(hull.points);
  for (const HullFace& face : faces) {
    planes->insert(planes->end(), {face.normal.x, face.normal.y, face.normal.z, face.offset_m});
    polygons->push_back(static_cast<unsigned>(face.corners.size()));
    for (const std::size_t corner : face.corners) polygons->push_back(static_cast<unsigned>(corner));
  }
  const dGeomID geom = dCreateConvex(nullptr, planes->data(), static_cast<unsigned>(faces.size()), points->data(),
                                     static_cast<unsigned>(hull.points.size()), polygons->data());
  numbers_.push_back(std::move(points));
  numbers_.push_back(std::move(planes));
  polygons_.push_back(std::move(polygons));
  return geom;
}

absl::Status OdeEngine::AddJoint(const JointDef& def) {
  const Body& a = *bodies_.at(def.body_a);
  const dBodyID b = def.body_b == BodyId() ? nullptr : bodies_.at(def.body_b)->ode;
  const Pose frame = Compose({a.def.initial.position, Normalized(a.def.initial.orientation)},
                             JointFrame({.origin = a.mass.origin, .axes = {}, .inertia_kg_m2 = {}}, def.frame_a));
  const Vec3d at = frame.position;
  dJointID joint = nullptr;
  if (std::holds_alternative<PointJoint>(def.kind)) {
    joint = dJointCreateBall(world_, nullptr);
    dJointAttach(joint, a.ode, b);
    dJointSetBallAnchor(joint, at.x, at.y, at.z);
  } else if (std::holds_alternative<FixedJoint>(def.kind)) {
    joint = dJointCreateFixed(world_, nullptr);
    dJointAttach(joint, a.ode, b);
    dJointSetFixed(joint);
  } else if (const auto* hinge = std::get_if<HingeJoint>(&def.kind)) {
    if (!hinge->limit_rad.free() || hinge->motor.max_force > 0) return Lacking(name(), "hinges with limits or motors");
    joint = dJointCreateHinge(world_, nullptr);
    dJointAttach(joint, a.ode, b);
    const Vec3d axis = Rotate(frame.orientation, {0, 0, 1});
    dJointSetHingeAnchor(joint, at.x, at.y, at.z);
    dJointSetHingeAxis(joint, axis.x, axis.y, axis.z);
  } else if (const auto* slider = std::get_if<SliderJoint>(&def.kind)) {
    if (!slider->limit_m.free() || slider->motor.max_force > 0) return Lacking(name(), "sliders with limits or motors");
    joint = dJointCreateSlider(world_, nullptr);
    dJointAttach(joint, a.ode, b);
    const Vec3d axis = Rotate(frame.orientation, {1, 0, 0});
    dJointSetSliderAxis(joint, axis.x, axis.y, axis.z);
  } else {
    return Lacking(name(), "joints other than point, fixed, hinge and slider");
  }
  return absl::OkStatus();
}

void OdeEngine::Near(void* self, dGeomID a, dGeomID b) { static_cast<OdeEngine*>(self)->Touch(a, b); }

void OdeEngine::Touch(dGeomID a, dGeomID b) {
  const auto& body_a = *static_cast<const Body*>(dGeomGetData(a));
  const auto& body_b = *static_cast<const Body*>(dGeomGetData(b));
  if (body_a.ode == body_b.ode || body_a.def.trigger || body_b.def.trigger) return;
  if (body_a.ode != nullptr && body_b.ode != nullptr &&
      dAreConnectedExcluding(body_a.ode, body_b.ode, dJointTypeContact)) {
    return;
  }
  dContact contacts[kMaxContacts];
  const int count = dCollide(a, b, kMaxContacts, &contacts[0].geom, sizeof(dContact));
  const Material &ma = body_a.def.material, &mb = body_b.def.material;
  const double restitution = PairRestitution(ma, mb);
  const double rolling = std::max(ma.rolling_friction, mb.rolling_friction);
  const double spinning = std::max(ma.spinning_friction, mb.spinning_friction);
  for (int i = 0; i < count; ++i) {
    dSurfaceParameters& surface = contacts[i].surface;
    surface = {};
    surface.mode = dContactApprox1;
    surface.mu = PairFriction(ma, mb);
    if (restitution > 0) {
      surface.mode |= dContactBounce;
      surface.bounce = restitution;
      surface.bounce_vel = 0;
    }
    if (rolling > 0 || spinning > 0) {
      surface.mode |= dContactRolling;
      surface.rho = surface.rho2 = rolling;
      surface.rhoN = spinning;
    }
    dJointAttach(dJointCreateContact(world_, contacts_, &contacts[i]), body_a.ode, body_b.ode);
  }
}

void OdeEngine::Push() {
  for (const Body* body : lighter_or_heavier_) {
    const Vec3d force = gravity_ * (body->def.gravity_scale * body->def.mass_kg);
    dBodyAddForce(body->ode, force.x, force.y, force.z);
  }
  for (const Force& force : forces_) {
    const dBodyID body = bodies_.at(force.on)->ode;
    dBodyEnable(body);
    dBodyAddForce(body, force.force.x, force.force.y, force.force.z);
    dBodyAddTorque(body, force.torque.x, force.torque.y, force.torque.z);
  }
}

void OdeEngine::Step(double dt_s) {
  const int steps = std::max(config_.substeps, 1);
  for (int i = 0; i < steps; ++i) {
    Push();
    dSpaceCollide(space_, this, &OdeEngine::Near);
    if (config_.direct) {
      dWorldStep(world_, dt_s / steps);
    } else {
      dWorldQuickStep(world_, dt_s / steps);
    }
    dJointGroupEmpty(contacts_);
  }
  forces_.clear();
}

void OdeEngine::SetState(BodyId id, const BodyState& state) {
  const Body& body = *bodies_.at(id);
  if (body.ode == nullptr) return;  // statics stay
  dBodySetPosition(body.ode, state.position.x, state.position.y, state.position.z);
  dQuaternion q;
  ToOde(Normalized(state.orientation) * body.mass.axes, q);
  dBodySetQuaternion(body.ode, q);
  const Vec3f v = state.linear_velocity, w = state.angular_velocity;
  dBodySetLinearVel(body.ode, v.x, v.y, v.z);
  dBodySetAngularVel(body.ode, w.x, w.y, w.z);
  if (state.asleep && config_.sleep && body.def.may_sleep) {
    dBodyDisable(body.ode);
  } else {
    dBodyEnable(body.ode);
  }
}

BodyState OdeEngine::StateOf(BodyId id) const {
  const Body& body = *bodies_.at(id);
  if (body.ode == nullptr) return body.def.initial;
  BodyState state;
  const dReal *p = dBodyGetPosition(body.ode), *q = dBodyGetQuaternion(body.ode);
  const dReal *v = dBodyGetLinearVel(body.ode), *w = dBodyGetAngularVel(body.ode);
  state.position = {p[0], p[1], p[2]};
  state.orientation = Normalized(Quatd{q[1], q[2], q[3], q[0]} * Conjugate(body.mass.axes));
  state.linear_velocity = Vec3f(Vec3d{v[0], v[1], v[2]});
  state.angular_velocity = Vec3f(Vec3d{w[0], w[1], w[2]});
  state.asleep = dBodyIsEnabled(body.ode) == 0;
  return state;
}

}  // namespace

std::unique_ptr<Engine> MakeOdeEngine(const EngineConfig& config) { return std::make_unique<OdeEngine>(config); }

}  // namespace tessera::bench
