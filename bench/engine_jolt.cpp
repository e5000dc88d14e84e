// Jolt as its HelloWorld sets it up: default settings, a tree each for what moves and what does not, one collision step
// a step unless told otherwise, the calling thread alone or a pool with it. A body's frame is that of its mass.
// Only its damping, .05 a second unless told otherwise, is the scene's: none.
#include <Jolt/Jolt.h>

#include <Jolt/Core/Factory.h>
#include <Jolt/Core/JobSystemSingleThreaded.h>
#include <Jolt/Core/JobSystemThreadPool.h>
#include <Jolt/Core/TempAllocator.h>
#include <Jolt/Physics/Body/BodyCreationSettings.h>
#include <Jolt/Physics/Collision/BroadPhase/BroadPhaseLayerInterfaceTable.h>
#include <Jolt/Physics/Collision/BroadPhase/ObjectVsBroadPhaseLayerFilterTable.h>
#include <Jolt/Physics/Collision/ObjectLayerPairFilterTable.h>
#include <Jolt/Physics/Collision/Shape/BoxShape.h>
#include <Jolt/Physics/Collision/Shape/CapsuleShape.h>
#include <Jolt/Physics/Collision/Shape/ConvexHullShape.h>
#include <Jolt/Physics/Collision/Shape/CylinderShape.h>
#include <Jolt/Physics/Collision/Shape/MeshShape.h>
#include <Jolt/Physics/Collision/Shape/PlaneShape.h>
#include <Jolt/Physics/Collision/Shape/RotatedTranslatedShape.h>
#include <Jolt/Physics/Collision/Shape/SphereShape.h>
#include <Jolt/Physics/Collision/Shape/StaticCompoundShape.h>
#include <Jolt/Physics/PhysicsSettings.h>
#include <Jolt/Physics/PhysicsSystem.h>
#include <Jolt/RegisterTypes.h>

#include <algorithm>
#include <memory>
#include <string>
#include <unordered_map>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "bench/engine_parts.h"

namespace tessera::bench {
namespace {

constexpr JPH::ObjectLayer kFixed = 0, kMoving = 1;
constexpr JPH::BroadPhaseLayer kFixedTree(0), kMovingTree(1);
// Pairs and contacts that it has room for; what goes beyond, it would leave out.
constexpr unsigned kMostPairs = 65536, kMostContacts = 65536;
constexpr unsigned kScratchBytes = 64 << 20;

JPH::Vec3 ToJolt(Vec3d v) { return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)}; }
JPH::Vec3 ToJolt(Vec3f v) { return {v.x, v.y, v.z}; }
JPH::Quat ToJolt(Quatd q) {
  q = Normalized(q);
  return JPH::Quat(static_cast<float>(q.x), static_cast<float>(q.y), static_cast<float>(q.z), static_cast<float>(q.w))
      .Normalized();
}
Vec3f FromJolt(JPH::Vec3 v) { return {v.GetX(), v.GetY(), v.GetZ()}; }

// Its allocator and types are registered once in a process, before anything of it is made.
struct Library {
  Library() {
    static const bool registered = [] {
      JPH::RegisterDefaultAllocator();
      JPH::Factory::sInstance = new JPH::Factory();
      JPH::RegisterTypes();
      return true;
    }();
    static_cast<void>(registered);
  }
};

// Which layers collide, and in which tree each lies.
struct Layers {
  Layers() : pairs(2), trees(2, 2) {
    pairs.EnableCollision(kFixed, kMoving);
    pairs.EnableCollision(kMoving, kMoving);
    trees.MapObjectToBroadPhaseLayer(kFixed, kFixedTree);
    trees.MapObjectToBroadPhaseLayer(kMoving, kMovingTree);
    against_trees = std::make_unique<JPH::ObjectVsBroadPhaseLayerFilterTable>(trees, 2, pairs, 2);
  }
  JPH::ObjectLayerPairFilterTable pairs;
  JPH::BroadPhaseLayerInterfaceTable trees;
  std::unique_ptr<JPH::ObjectVsBroadPhaseLayerFilterTable> against_trees;
};

using MadeShape = absl::StatusOr<JPH::ShapeRefC>;

MadeShape Made(const JPH::ShapeSettings& settings) {
  const JPH::ShapeSettings::ShapeResult result = settings.Create();
  if (result.HasError()) return absl::InternalError(absl::StrCat("jolt: ", result.GetError().c_str()));
  return result.Get();
}

// Settings on the stack, which a shape must not free.
template <class Settings>
MadeShape MadeOf(Settings settings) {
  settings.SetEmbedded();
  return Made(settings);
}

float Rounding(double least_half_m) { return std::min(JPH::cDefaultConvexRadius, static_cast<float>(least_half_m)); }

MadeShape MakeShape(const Shape& shape);

MadeShape MakeCompound(const CompoundShape& compound) {
  JPH::StaticCompoundShapeSettings settings;
  settings.SetEmbedded();
  for (const CompoundChild& child : compound.children) {
    const MadeShape made = MakeShape(*child.shape);
    if (!made.ok()) return made;
    settings.AddShape(ToJolt(child.pose.position), ToJolt(child.pose.orientation), *made);
  }
  return Made(settings);
}

MadeShape MakeMesh(const TriangleMeshShape& mesh) {
  JPH::VertexList vertices;
  for (const Vec3f& v : mesh.vertices) vertices.push_back({v.x, v.y, v.z});
  JPH::IndexedTriangleList triangles;
  for (const auto& t : mesh.triangles) {
    triangles.push_back(
        {static_cast<JPH::uint32>(t[0]), static_cast<JPH::uint32>(t[1]), static_cast<JPH::uint32>(t[2])});
  }
  return MadeOf(JPH::MeshShapeSettings(std::move(vertices), std::move(triangles)));
}

// A shape in its own coordinates.
MadeShape MakeShape(const Shape& shape) {
  if (const auto* box = std::get_if<BoxShape>(&shape.form)) {
    const Vec3d h = box->half_extents_m;
    return MadeOf(JPH::BoxShapeSettings(ToJolt(h), Rounding(std::min({h.x, h.y, h.z}))));
  }
  if (const auto* ball = std::get_if<SphereShape>(&shape.form)) {
    return MadeOf(JPH::SphereShapeSettings(static_cast<float>(ball->radius_m)));
  }
  if (const auto* rod = std::get_if<CapsuleShape>(&shape.form)) {
    return MadeOf(JPH::CapsuleShapeSettings(static_cast<float>(rod->half_height_m), static_cast<float>(rod->radius_m)));
  }
  if (const auto* can = std::get_if<CylinderShape>(&shape.form)) {
    return MadeOf(JPH::CylinderShapeSettings(static_cast<float>(can->half_height_m), static_cast<float>(can->radius_m),
                                             Rounding(std::min(can->half_height_m, can->radius_m))));
  }
  if (const auto* plane = std::get_if<PlaneShape>(&shape.form)) {
    return MadeOf(JPH::PlaneShapeSettings(JPH::Plane(ToJolt(plane->normal), static_cast<float>(-plane->offset_m))));
  }
  if (const auto* hull = std::get_if<ConvexHullShape>(&shape.form)) {
    JPH::Array<JPH::Vec3> points;
    for (const Vec3f& p : hull->points) points.push_back(ToJolt(p));
    return MadeOf(JPH::ConvexHullShapeSettings(points));
  }
  if (const auto* compound = std::get_if<CompoundShape>(&shape.form)) return MakeCompound(*compound);
  if (const auto* mesh = std::get_if<TriangleMeshShape>(&shape.form)) return MakeMesh(*mesh);
  return Lacking(EngineName(EngineKind::kJolt), "cones and height fields");
}

class JoltEngine : public Engine {
 public:
  explicit JoltEngine(const EngineConfig& config) : config_(config) {
    scratch_ = std::make_unique<JPH::TempAllocatorImplWithMallocFallback>(kScratchBytes);
    if (config.threads > 1) {
      jobs_ = std::make_unique<JPH::JobSystemThreadPool>(static_cast<unsigned>(JPH::cMaxPhysicsJobs),
                                                         static_cast<unsigned>(JPH::cMaxPhysicsBarriers),
                                                         config.threads - 1);
    } else {
      jobs_ = std::make_unique<JPH::JobSystemSingleThreaded>(static_cast<unsigned>(JPH::cMaxPhysicsJobs));
    }
  }
  std::string_view name() const override { return EngineName(EngineKind::kJolt); }

  absl::Status Load(const Scene& scene) override;
  void Step(double dt_s) override;
  BodyState StateOf(BodyId id) const override;
  void SetState(BodyId id, const BodyState& state) override;
  void ApplyForce(BodyId id, Vec3f force_n, Vec3f torque_nm) override {
    forces_.push_back({bodies_.at(id).jolt, ToJolt(force_n), ToJolt(torque_nm)});
  }

 private:
  struct Body {
    BodyDef def;
    MassFrame mass;
    JPH::BodyID jolt;
  };
  struct Force {
    JPH::BodyID on;
    JPH::Vec3 force, torque;
  };
  absl::Status AddBody(const BodyDef& def);
  MadeShape ShapeOf(const BodyDef& def, const MassFrame& mass);
  JPH::BodyInterface& bodies() { return system_.GetBodyInterfaceNoLock(); }

  Library library_;
  EngineConfig config_;
  Layers layers_;
  std::unique_ptr<JPH::TempAllocator> scratch_;
  std::unique_ptr<JPH::JobSystem> jobs_;
  JPH::PhysicsSystem system_;
  std::unordered_map<BodyId, Body> bodies_;
  std::unordered_map<const Shape*, JPH::ShapeRefC> made_;  // with trivial mass frames; bodies share them
  std::vector<Force> forces_;
};

absl::Status JoltEngine::Load(const Scene& scene) {
  if (!scene.fields.empty()) return Lacking(name(), "fields");
  if (!scene.joints.empty()) return Lacking(name(), "joints here");
  system_.Init(static_cast<unsigned>(scene.bodies.size()) + 1, 0, kMostPairs, kMostContacts, layers_.trees,
               *layers_.against_trees, layers_.pairs);
  system_.SetGravity(ToJolt(scene.gravity_m_s2));
  if (config_.iterations > 0) {
    JPH::PhysicsSettings settings = system_.GetPhysicsSettings();
    settings.mNumVelocitySteps = static_cast<unsigned>(config_.iterations);
    system_.SetPhysicsSettings(settings);
  }
  for (const BodyDef& def : scene.bodies) {
    if (absl::Status status = AddBody(def); !status.ok()) return status;
  }
  system_.OptimizeBroadPhase();
  return absl::OkStatus();
}

MadeShape JoltEngine::ShapeOf(const BodyDef& def, const MassFrame& mass) {
  JPH::ShapeRefC& made = made_[def.shape.get()];
  if (made == nullptr) {
    const MadeShape shape = MakeShape(*def.shape);
    if (!shape.ok()) return shape;
    made = *shape;
  }
  if (mass.trivial()) return made;
  const Pose pose = mass.ShapePose();
  return MadeOf(JPH::RotatedTranslatedShapeSettings(ToJolt(pose.position), ToJolt(pose.orientation), made));
}

absl::Status JoltEngine::AddBody(const BodyDef& def) {
  if (def.linear_damping > 0 || def.angular_damping > 0) return Lacking(name(), "damping by shares");
  if (def.trigger) return Lacking(name(), "triggers");
  if (def.material.rolling_friction > 0 || def.material.spinning_friction > 0) {
    return Lacking(name(), "rolling and spinning friction");
  }
  const bool dynamic = def.motion == Motion::kDynamic;
  Body body{.def = def, .mass = MassFrameOf(def), .jolt = {}};
  const MadeShape shape = ShapeOf(def, body.mass);
  if (!shape.ok()) return shape.status();
  JPH::BodyCreationSettings settings(
      *shape, ToJolt(def.initial.position), ToJolt(Normalized(def.initial.orientation) * body.mass.axes),
      dynamic ? JPH::EMotionType::Dynamic : JPH::EMotionType::Static, dynamic ? kMoving : kFixed);
  settings.mFriction = static_cast<float>(def.material.friction);
  settings.mRestitution = static_cast<float>(def.material.restitution);
  settings.mGravityFactor = static_cast<float>(def.gravity_scale);
  settings.mLinearDamping = settings.mAngularDamping = 0;
  settings.mAllowSleeping = config_.sleep && def.may_sleep;
  if (dynamic) {
    settings.mOverrideMassProperties = JPH::EOverrideMassProperties::MassAndInertiaProvided;
    settings.mMassPropertiesOverride.mMass = static_cast<float>(def.mass_kg);
    settings.mMassPropertiesOverride.mInertia = JPH::Mat44::sScale(ToJolt(body.mass.inertia_kg_m2));
  }
  body.jolt =
      bodies().CreateAndAddBody(settings, dynamic ? JPH::EActivation::Activate : JPH::EActivation::DontActivate);
  if (body.jolt.IsInvalid()) return absl::ResourceExhaustedError("jolt: no room for a body");
  bodies_.emplace(def.id, body);
  SetState(def.id, def.initial);
  return absl::OkStatus();
}

void JoltEngine::Step(double dt_s) {
  const int steps = std::max(config_.substeps, 1);
  for (int i = 0; i < steps; ++i) {
    for (const Force& force : forces_) {
      bodies().AddForce(force.on, force.force);
      bodies().AddTorque(force.on, force.torque);
    }
    system_.Update(static_cast<float>(dt_s / steps), 1, scratch_.get(), jobs_.get());
  }
  forces_.clear();
}

void JoltEngine::SetState(BodyId id, const BodyState& state) {
  const Body& body = bodies_.at(id);
  if (body.def.motion != Motion::kDynamic) return;
  // The frame's origin is the centre of mass but for rounding.
  const JPH::Quat orientation = ToJolt(Normalized(state.orientation) * body.mass.axes);
  const JPH::Vec3 center = bodies().GetShape(body.jolt)->GetCenterOfMass();
  bodies().SetPositionAndRotation(body.jolt, ToJolt(state.position) - orientation * center, orientation,
                                  JPH::EActivation::Activate);
  bodies().SetLinearAndAngularVelocity(body.jolt, ToJolt(state.linear_velocity), ToJolt(state.angular_velocity));
  if (state.asleep && config_.sleep && body.def.may_sleep) bodies().DeactivateBody(body.jolt);
}

BodyState JoltEngine::StateOf(BodyId id) const {
  const Body& body = bodies_.at(id);
  if (body.def.motion != Motion::kDynamic) return body.def.initial;
  const JPH::BodyInterface& interface = system_.GetBodyInterfaceNoLock();
  const JPH::Quat q = interface.GetRotation(body.jolt);
  BodyState state;
  state.position = Vec3d(FromJolt(interface.GetCenterOfMassPosition(body.jolt)));
  state.orientation = Normalized(Quatd{q.GetX(), q.GetY(), q.GetZ(), q.GetW()} * Conjugate(body.mass.axes));
  state.linear_velocity = FromJolt(interface.GetLinearVelocity(body.jolt));
  state.angular_velocity = FromJolt(interface.GetAngularVelocity(body.jolt));
  state.asleep = !interface.IsActive(body.jolt);
  return state;
}

}  // namespace

std::unique_ptr<Engine> MakeJoltEngine(const EngineConfig& config) { return std::make_unique<JoltEngine>(config); }

}  // namespace tessera::bench
