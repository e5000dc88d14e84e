// Stock Bullet, as a game sets it up: default configuration, dispatcher and sequential impulse solver,
// btDbvtBroadphase, plain btRigidBody. Bullet multiplies the frictions of a pair, so each body has the root of its own:
// the product is then the geometric mean. Nothing here is Tessera's.
#include <btBulletDynamicsCommon.h>

#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <LinearMath/btConvexHullComputer.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <unordered_map>
#include <vector>

#include "bench/engine_parts.h"

namespace tessera::bench {
namespace {

btVector3 ToBullet(Vec3d v) {
  return {static_cast<btScalar>(v.x), static_cast<btScalar>(v.y), static_cast<btScalar>(v.z)};
}
btVector3 ToBullet(Vec3f v) { return {v.x, v.y, v.z}; }
btTransform ToBullet(const Pose& pose) {
  const Quatd q = Normalized(pose.orientation);
  return btTransform(btQuaternion(static_cast<btScalar>(q.x), static_cast<btScalar>(q.y), static_cast<btScalar>(q.z),
                                  static_cast<btScalar>(q.w)),
                     ToBullet(pose.position));
}
Vec3f FromBullet(const btVector3& v) { return {v.x(), v.y(), v.z()}; }

// Bullet's rules of pairs are globals of the process, which Tessera's worlds may have set. While this lives they are as
// Bullet comes.
class StockRules {
 public:
  StockRules()
      : friction_(gCalculateCombinedFrictionCallback),
        restitution_(gCalculateCombinedRestitutionCallback),
        rolling_(gCalculateCombinedRollingFrictionCallback),
        spinning_(gCalculateCombinedSpinningFrictionCallback),
        added_(gContactAddedCallback) {
    gCalculateCombinedFrictionCallback = &btManifoldResult::calculateCombinedFriction;
    gCalculateCombinedRestitutionCallback = &btManifoldResult::calculateCombinedRestitution;
    gCalculateCombinedRollingFrictionCallback = &btManifoldResult::calculateCombinedRollingFriction;
    gCalculateCombinedSpinningFrictionCallback = &btManifoldResult::calculateCombinedSpinningFriction;
    gContactAddedCallback = nullptr;
  }
  ~StockRules() {
    gCalculateCombinedFrictionCallback = friction_;
    gCalculateCombinedRestitutionCallback = restitution_;
    gCalculateCombinedRollingFrictionCallback = rolling_;
    gCalculateCombinedSpinningFrictionCallback = spinning_;
    gContactAddedCallback = added_;
  }
  StockRules(const StockRules&) = delete;
  StockRules& operator=(const StockRules&) = delete;

 private:
  CalculateCombinedCallback friction_, restitution_, rolling_, spinning_;
  ContactAddedCallback added_;
};

// Bullet's shapes of a scene's shapes, in the coordinates of the latter; keeps what they point into.
class ShapeStore {
 public:
  btCollisionShape* Make(const Shape& shape) {
    return std::visit([this](const auto& form) { return Of(form); }, shape.form);
  }
  // `shape` as seen from a body whose mass is not at its origin.
  btCollisionShape* Make(const Shape& shape, const MassFrame& mass) {
    if (const auto* hull = std::get_if<ConvexHullShape>(&shape.form)) return Hull(*hull, mass.ShapePose());
    btCollisionShape* made = Make(shape);
    if (mass.trivial()) return made;
    auto compound = std::make_unique<btCompoundShape>();
    compound->addChildShape(ToBullet(mass.ShapePose()), made);
    return Keep(std::move(compound));
  }

 private:
  template <class T>
  T* Keep(std::unique_ptr<T> shape) {
    T* result = shape.get();
    shapes_.push_back(std::move(shape));
    return result;
  }

  btCollisionShape* Of(const BoxShape& box) { return Keep(std::make_unique<btBoxShape>(ToBullet(box.half_extents_m))); }
  btCollisionShape* Of(const SphereShape& ball) {
    return Keep(std::make_unique<btSphereShape>(static_cast<btScalar>(ball.radius_m)));
  }
  btCollisionShape* Of(const CapsuleShape& capsule) {
    return Keep(std::make_unique<btCapsuleShape>(static_cast<btScalar>(capsule.radius_m),
                                                 static_cast<btScalar>(2 * capsule.half_height_m)));
  }
  btCollisionShape* Of(const CylinderShape& cylinder) {
    return Keep(std::make_unique<btCylinderShape>(
        ToBullet(Vec3d{cylinder.radius_m, cylinder.half_height_m, cylinder.radius_m})));
  }
  btCollisionShape* Of(const ConeShape& cone) {
    return Keep(
        std::make_unique<btConeShape>(static_cast<btScalar>(cone.radius_m), static_cast<btScalar>(cone.height_m)));
  }
  btCollisionShape* Of(const ConvexHullShape& hull) { return Hull(hull, {}); }
  btCollisionShape* Of(const CompoundShape& compound) {
    auto result = std::make_unique<btCompoundShape>();
    for (const CompoundChild& child : compound.children) {
      result->addChildShape(ToBullet(child.pose), Make(*child.shape));
    }
    return Keep(std::move(result));
  }
  btCollisionShape* Of(const TriangleMeshShape& mesh) {
    btIndexedMesh part;
    part.m_numTriangles = static_cast<int>(mesh.triangles.size());
    part.m_triangleIndexBase = reinterpret_cast<const unsigned char*>(mesh.triangles.data());
    part.m_triangleIndexStride = sizeof(mesh.triangles[0]);
    part.m_numVertices = static_cast<int>(mesh.vertices.size());
    part.m_vertexBase = reinterpret_cast<const unsigned char*>(mesh.vertices.data());
    part.m_vertexStride = sizeof(Vec3f);
    arrays_.push_back(std::make_unique<btTriangleIndexVertexArray>());
    arrays_.back()->addIndexedMesh(part, PHY_INTEGER);
    return Keep(std::make_unique<btBvhTriangleMeshShape>(arrays_.back().get(), true));
  }
  btCollisionShape* Of(const HeightFieldShape& field) {
    const auto [low, high] = std::minmax_element(field.heights_m.begin(), field.heights_m.end());
    auto shape = std::make_unique<btHeightfieldTerrainShape>(
        static_cast<int>(field.columns), static_cast<int>(field.rows), field.heights_m.data(), *low, *high, 1, false);
    const auto spacing = static_cast<btScalar>(field.spacing_m);
    shape->setLocalScaling({spacing, 1, spacing});
    // Bullet centres it between its lowest and its highest point.
    auto compound = std::make_unique<btCompoundShape>();
    compound->addChildShape(btTransform(btQuaternion::getIdentity(), {0, (*low + *high) / 2, 0}),
                            Keep(std::move(shape)));
    return Keep(std::move(compound));
  }
  btCollisionShape* Of(const PlaneShape& plane) {
    return Keep(std::make_unique<btStaticPlaneShape>(ToBullet(plane.normal), static_cast<btScalar>(plane.offset_m)));
  }

  // Shrunk by the margin that Bullet adds again, as its own demos do, so that the body has the size it was given.
  btCollisionShape* Hull(const ConvexHullShape& hull, const Pose& pose) {
    std::vector<Vec3f> points;
    for (const Vec3f& p : hull.points) points.push_back(Vec3f(pose.position + Rotate(pose.orientation, Vec3d(p))));
    btConvexHullComputer computer;
    constexpr btScalar kShrinkShare = 0.25f;  // share of the inner radius, at most
    const btScalar margin = computer.compute(&points[0].x, sizeof(Vec3f), static_cast<int>(points.size()),
                                             CONVEX_DISTANCE_MARGIN, kShrinkShare);
    if (margin < 0) computer.compute(&points[0].x, sizeof(Vec3f), static_cast<int>(points.size()), 0, 0);
    auto shape =
        std::make_unique<btConvexHullShape>(&computer.vertices[0].x(), computer.vertices.size(), sizeof(btVector3));
    shape->setMargin(std::max(margin, btScalar(0)));
    return Keep(std::move(shape));
  }

  std::vector<std::unique_ptr<btTriangleIndexVertexArray>> arrays_;
  std::vector<std::unique_ptr<btCollisionShape>> shapes_;
};

class BulletEngine : public Engine {
 public:
  explicit BulletEngine(const EngineConfig& config)
      : config_(config),
        dispatcher_(&configuration_),
        world_(&dispatcher_, &broadphase_, &solver_, &configuration_),
        ground_(btRigidBody::btRigidBodyConstructionInfo(0, nullptr, nullptr)) {
    if (config.iterations > 0) world_.getSolverInfo().m_numIterations = config.iterations;
  }
  ~BulletEngine() override {
    for (const auto& joint : joints_) world_.removeConstraint(joint.get());
    for (const auto& [id, body] : bodies_) world_.removeRigidBody(body.rigid.get());
  }
  std::string_view name() const override { return EngineName(EngineKind::kBullet); }

  absl::Status Load(const Scene& scene) override;
  void Step(double dt_s) override;
  BodyState StateOf(BodyId id) const override;
  void SetState(BodyId id, const BodyState& state) override;
  void ApplyForce(BodyId id, Vec3f force_n, Vec3f torque_nm) override {
    forces_.push_back({bodies_.at(id).rigid.get(), ToBullet(force_n), ToBullet(torque_nm)});
  }

 private:
  struct Body {
    std::unique_ptr<btRigidBody> rigid;
    MassFrame mass;
  };
  struct Force {
    btRigidBody* on;
    btVector3 force, torque;
  };
  void Add(const BodyDef& def, double restitution, const Vec3d& gravity);
  btCollisionShape* ShapeOf(const BodyDef& def, const MassFrame& mass);
  absl::Status AddJoint(const JointDef& def);

  EngineConfig config_;
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_;
  btDbvtBroadphase broadphase_;
  btSequentialImpulseConstraintSolver solver_;
  btDiscreteDynamicsWorld world_;
  btRigidBody ground_;  // the anchor of joints to the world
  ShapeStore shapes_;
  std::map<std::pair<const Shape*, bool>, btCollisionShape*> made_;  // by shape and whether by its own inertia
  std::unordered_map<BodyId, Body> bodies_;
  std::vector<std::unique_ptr<btTypedConstraint>> joints_;
  std::vector<Force> forces_;
};

absl::Status BulletEngine::Load(const Scene& scene) {
  if (!scene.fields.empty()) return Lacking(name(), "fields");
  const double restitution = CommonRestitution(scene);
  if (restitution < 0) return Lacking(name(), "bodies of different restitution");
  world_.setGravity(ToBullet(scene.gravity_m_s2));
  for (const BodyDef& def : scene.bodies) Add(def, restitution, scene.gravity_m_s2);
  for (const JointDef& def : scene.joints) {
    if (absl::Status status = AddJoint(def); !status.ok()) return status;
  }
  return absl::OkStatus();
}

btCollisionShape* BulletEngine::ShapeOf(const BodyDef& def, const MassFrame& mass) {
  if (def.motion == Motion::kStatic) return shapes_.Make(*def.shape);
  btCollisionShape*& made = made_[{def.shape.get(), def.inertia_kg_m2.has_value()}];
  if (made == nullptr) made = shapes_.Make(*def.shape, mass);
  return made;
}

void BulletEngine::Add(const BodyDef& def, double restitution, const Vec3d& gravity) {
  const bool dynamic = def.motion == Motion::kDynamic;
  Body body{.rigid = nullptr, .mass = MassFrameOf(def)};
  btRigidBody::btRigidBodyConstructionInfo info(static_cast<btScalar>(dynamic ? def.mass_kg : 0), nullptr,
                                                ShapeOf(def, body.mass), ToBullet(body.mass.inertia_kg_m2));
  info.m_friction = static_cast<btScalar>(std::sqrt(def.material.friction));
  info.m_restitution = static_cast<btScalar>(std::sqrt(restitution));
  info.m_rollingFriction = static_cast<btScalar>(def.material.rolling_friction);
  info.m_spinningFriction = static_cast<btScalar>(def.material.spinning_friction);
  info.m_linearDamping = static_cast<btScalar>(def.linear_damping);
  info.m_angularDamping = static_cast<btScalar>(def.angular_damping);
  body.rigid = std::make_unique<btRigidBody>(info);
  if (def.trigger) {
    body.rigid->setCollisionFlags(body.rigid->getCollisionFlags() | btCollisionObject::CF_NO_CONTACT_RESPONSE);
  }
  world_.addRigidBody(body.rigid.get());
  if (dynamic) body.rigid->setGravity(ToBullet(gravity * def.gravity_scale));
  if (dynamic && !(config_.sleep && def.may_sleep)) body.rigid->setActivationState(DISABLE_DEACTIVATION);
  bodies_.emplace(def.id, std::move(body));
  SetState(def.id, def.initial);
}

void BulletEngine::SetState(BodyId id, const BodyState& state) {
  const Body& body = bodies_.at(id);
  const Pose pose{state.position, Normalized(state.orientation) * body.mass.axes};
  body.rigid->setWorldTransform(ToBullet(pose));
  body.rigid->setInterpolationWorldTransform(body.rigid->getWorldTransform());
  body.rigid->setLinearVelocity(ToBullet(state.linear_velocity));
  body.rigid->setAngularVelocity(ToBullet(state.angular_velocity));
  body.rigid->updateInertiaTensor();
  if (body.rigid->isStaticObject()) {
    world_.updateSingleAabb(body.rigid.get());
  } else if (state.asleep && body.rigid->getActivationState() != DISABLE_DEACTIVATION) {
    body.rigid->forceActivationState(ISLAND_SLEEPING);
    world_.updateSingleAabb(body.rigid.get());
  } else {
    body.rigid->activate();
  }
}

BodyState BulletEngine::StateOf(BodyId id) const {
  const Body& body = bodies_.at(id);
  const btTransform& transform = body.rigid->getWorldTransform();
  const btQuaternion q = transform.getRotation();
  BodyState state;
  state.position = Vec3d(FromBullet(transform.getOrigin()));
  const Quatd orientation{q.x(), q.y(), q.z(), q.w()};
  state.orientation = Normalized(orientation * Conjugate(body.mass.axes));
  state.linear_velocity = FromBullet(body.rigid->getLinearVelocity());
  state.angular_velocity = FromBullet(body.rigid->getAngularVelocity());
  state.asleep = body.rigid->getActivationState() == ISLAND_SLEEPING;
  return state;
}

absl::Status BulletEngine::AddJoint(const JointDef& def) {
  const Body& a = bodies_.at(def.body_a);
  const Body* b = def.body_b == BodyId() ? nullptr : &bodies_.at(def.body_b);
  btRigidBody& other = b != nullptr ? *b->rigid : ground_;
  const btTransform frame_a = ToBullet(JointFrame(a.mass, def.frame_a));
  const btTransform frame_b = ToBullet(b != nullptr ? JointFrame(b->mass, def.frame_b) : def.frame_b);
  std::unique_ptr<btTypedConstraint> joint;
  if (std::holds_alternative<PointJoint>(def.kind)) {
    joint = std::make_unique<btPoint2PointConstraint>(*a.rigid, other, frame_a.getOrigin(), frame_b.getOrigin());
  } else if (std::holds_alternative<FixedJoint>(def.kind)) {
    joint = std::make_unique<btFixedConstraint>(*a.rigid, other, frame_a, frame_b);
  } else if (const auto* hinge = std::get_if<HingeJoint>(&def.kind)) {
    if (!hinge->limit_rad.free() || hinge->motor.max_force > 0) return Lacking(name(), "hinges with limits or motors");
    joint = std::make_unique<btHingeConstraint>(*a.rigid, other, frame_a, frame_b);
  } else if (const auto* slider = std::get_if<SliderJoint>(&def.kind)) {
    if (!slider->limit_m.free() || slider->motor.max_force > 0) return Lacking(name(), "sliders with limits or motors");
    auto made = std::make_unique<btSliderConstraint>(*a.rigid, other, frame_a, frame_b, true);
    made->setLowerLinLimit(1);  // lower over upper: free
    made->setUpperLinLimit(-1);
    made->setLowerAngLimit(0);
    made->setUpperAngLimit(0);
    joint = std::move(made);
  } else {
    return Lacking(name(), "joints other than point, fixed, hinge and slider");
  }
  world_.addConstraint(joint.get(), !def.bodies_collide);
  joints_.push_back(std::move(joint));
  return absl::OkStatus();
}

void BulletEngine::Step(double dt_s) {
  const StockRules rules;
  const int steps = std::max(config_.substeps, 1);
  for (int i = 0; i < steps; ++i) {
    for (const Force& force : forces_) {
      force.on->activate();
      force.on->applyCentralForce(force.force);
      force.on->applyTorque(force.torque);
    }
    world_.stepSimulation(static_cast<btScalar>(dt_s / steps), 0);
  }
  forces_.clear();
}

}  // namespace

std::unique_ptr<Engine> MakeBulletEngine(const EngineConfig& config) { return std::make_unique<BulletEngine>(config); }

}  // namespace tessera::bench
