// MuJoCo with its default options, its model written as MJCF: bodies with a free joint each, and no joints between
// them, which is what the first scenes of the suite need. A body's frame is its shape's axes at its centre of mass.
//
// Its contacts are springs; restitution is their damping. `solref` is given in its direct form: stiffness of its own
// default (time constant .02 s, damping ratio 1) and the damping that e leaves of an oscillation.
#include <fmt/format.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <string>
#include <unordered_map>
#include <vector>

#include "absl/status/statusor.h"
#include "bench/engine_parts.h"

namespace tessera::bench {
namespace {

std::string Xml(Vec3d v) { return fmt::format("{:.17g} {:.17g} {:.17g}", v.x, v.y, v.z); }
std::string Xml(Quatd q) {
  q = Normalized(q);
  return fmt::format("{:.17g} {:.17g} {:.17g} {:.17g}", q.w, q.x, q.y, q.z);
}

// Damping ratio of an oscillator that gives back e of its speed after half a swing.
double DampingRatio(double restitution) {
  const double log = std::log(std::max(restitution, 1e-6));
  return -log / std::hypot(std::numbers::pi, log);
}

// A model as text, which grows by bodies.
class Mjcf {
 public:
  absl::Status Add(const BodyDef& def, const MassFrame& mass, double restitution);
  std::string Text(const Scene& scene, const EngineConfig& config) const {
    const std::string iterations = config.iterations > 0 ? fmt::format(" iterations=\"{}\"", config.iterations) : "";
    // Contacts beyond its own guess would be left out, and towers sink into the ground. A contact has four rows.
    const std::size_t contacts = 16 * scene.bodies.size() + 100;
    return fmt::format(
        "<mujoco><compiler angle=\"radian\"/><size nconmax=\"{}\" njmax=\"{}\"/><option gravity=\"{}\"{}/>"
        "<asset>{}</asset><worldbody>{}</worldbody></mujoco>",
        contacts, 4 * contacts, Xml(scene.gravity_m_s2), iterations, assets_, bodies_);
  }

 private:
  // `pose`: of the shape in its body.
  absl::StatusOr<std::string> Geom(const Shape& shape, const Pose& pose, const std::string& surface);

  std::string assets_, bodies_;
  int hulls_ = 0;
};

std::string SurfaceOf(const Material& material, double restitution) {
  std::string surface = fmt::format("friction=\"{:.17g} {:.17g} {:.17g}\"", material.friction,
                                    material.spinning_friction, material.rolling_friction);
  if (material.friction == 0) {
    surface += " condim=\"1\"";
  } else if (material.rolling_friction > 0 || material.spinning_friction > 0) {
    surface += " condim=\"6\"";
  }
  if (restitution > 0) {
    constexpr double kRate_s = 1 / 0.02;
    surface += fmt::format(" solref=\"{:.17g} {:.17g}\"", -kRate_s * kRate_s, -2 * kRate_s * DampingRatio(restitution));
  }
  return surface;
}

absl::StatusOr<std::string> Mjcf::Geom(const Shape& shape, const Pose& pose, const std::string& surface) {
  std::string form;
  Pose at = pose;
  if (const auto* box = std::get_if<BoxShape>(&shape.form)) {
    form = fmt::format("type=\"box\" size=\"{}\"", Xml(box->half_extents_m));
  } else if (const auto* ball = std::get_if<SphereShape>(&shape.form)) {
    form = fmt::format("type=\"sphere\" size=\"{:.17g}\"", ball->radius_m);
  } else if (const auto* capsule = std::get_if<CapsuleShape>(&shape.form)) {
    form = fmt::format("type=\"capsule\" size=\"{:.17g} {:.17g}\"", capsule->radius_m, capsule->half_height_m);
    at = Compose(pose, {{}, TurnFromZ({0, 1, 0})});
  } else if (const auto* cylinder = std::get_if<CylinderShape>(&shape.form)) {
    form = fmt::format("type=\"cylinder\" size=\"{:.17g} {:.17g}\"", cylinder->radius_m, cylinder->half_height_m);
    at = Compose(pose, {{}, TurnFromZ({0, 1, 0})});
  } else if (const auto* plane = std::get_if<PlaneShape>(&shape.form)) {
    form = "type=\"plane\" size=\"0 0 1\"";  // endless
    at = Compose(pose, {plane->normal * plane->offset_m, TurnFromZ(plane->normal)});
  } else if (const auto* hull = std::get_if<ConvexHullShape>(&shape.form)) {
    std::string points;
    for (const Vec3f& p : hull->points) points += Xml(Vec3d(p)) + " ";
    assets_ += fmt::format("<mesh name=\"hull{}\" vertex=\"{}\"/>", hulls_, points);
    form = fmt::format("type=\"mesh\" mesh=\"hull{}\"", hulls_++);
  } else {
    return Lacking(EngineName(EngineKind::kMujoco), "cones, compounds, meshes and height fields");
  }
  return fmt::format("<geom {} pos=\"{}\" quat=\"{}\" {}/>", form, Xml(at.position), Xml(at.orientation), surface);
}

absl::Status Mjcf::Add(const BodyDef& def, const MassFrame& mass, double restitution) {
  const bool dynamic = def.motion == Motion::kDynamic;
  const auto geom = Geom(*def.shape, {-mass.origin, {}}, SurfaceOf(def.material, restitution));
  if (!geom.ok()) return geom.status();
  bodies_ += fmt::format("<body name=\"b{}\" pos=\"{}\" quat=\"{}\"{}>", def.id.value(), Xml(def.initial.position),
                         Xml(def.initial.orientation),
                         def.gravity_scale != 1 ? fmt::format(" gravcomp=\"{:.17g}\"", 1 - def.gravity_scale) : "");
  if (dynamic) {
    bodies_ += fmt::format("<freejoint/><inertial pos=\"0 0 0\" quat=\"{}\" mass=\"{:.17g}\" diaginertia=\"{}\"/>",
                           Xml(mass.axes), def.mass_kg, Xml(mass.inertia_kg_m2));
  }
  bodies_ += *geom + "</body>";
  return absl::OkStatus();
}

class MujocoEngine : public Engine {
 public:
  explicit MujocoEngine(const EngineConfig& config) : config_(config) {
    mju_user_warning = [](const char*) {};  // else it writes a log into the working directory
  }
  ~MujocoEngine() override {
    if (data_ != nullptr) mj_deleteData(data_);
    if (model_ != nullptr) mj_deleteModel(model_);
  }
  MujocoEngine(const MujocoEngine&) = delete;
  MujocoEngine& operator=(const MujocoEngine&) = delete;
  std::string_view name() const override { return EngineName(EngineKind::kMujoco); }

  absl::Status Load(const Scene& scene) override;
  void Step(double dt_s) override;
  BodyState StateOf(BodyId id) const override;
  void SetState(BodyId id, const BodyState& state) override;
  void ApplyForce(BodyId id, Vec3f force_n, Vec3f torque_nm) override;

 private:
  struct Body {
    BodyState initial;  // a static body keeps it for ever
    bool dynamic = false;
    int index = 0;                // MuJoCo's index of the body
    int position = 0, speed = 0;  // where its free joint lies in qpos and qvel
  };
  absl::Status Compile(const std::string& text);

  EngineConfig config_;
  mjModel* model_ = nullptr;
  mjData* data_ = nullptr;
  bool blown_up_ = false;  // it starts again from its first state then, which no benchmark may take for a result
  std::unordered_map<BodyId, Body> bodies_;
};

// Friction and restitution of a pair follow rules of MuJoCo's own, so all bodies have to have the same.
absl::Status CheckMaterials(const Scene& scene, std::string_view engine) {
  for (const BodyDef& def : scene.bodies) {
    if (def.material.friction != scene.bodies[0].material.friction)
      return Lacking(engine, "bodies of different friction");
    if (def.linear_damping > 0 || def.angular_damping > 0) return Lacking(engine, "damping by shares");
    if (def.trigger) return Lacking(engine, "triggers");
  }
  if (CommonRestitution(scene) < 0) return Lacking(engine, "bodies of different restitution");
  return absl::OkStatus();
}

absl::Status MujocoEngine::Load(const Scene& scene) {
  if (!scene.fields.empty()) return Lacking(name(), "fields");
  if (!scene.joints.empty()) return Lacking(name(), "joints");
  if (absl::Status status = CheckMaterials(scene, name()); !status.ok()) return status;
  Mjcf model;
  for (const BodyDef& def : scene.bodies) {
    if (absl::Status status = model.Add(def, MassFrameOf(def), CommonRestitution(scene)); !status.ok()) return status;
  }
  if (absl::Status status = Compile(model.Text(scene, config_)); !status.ok()) return status;
  for (const BodyDef& def : scene.bodies) {
    Body body{.initial = def.initial, .dynamic = def.motion == Motion::kDynamic, .index = 0, .position = 0, .speed = 0};
    body.index = mj_name2id(model_, mjOBJ_BODY, fmt::format("b{}", def.id.value()).c_str());
    if (body.dynamic) {
      const int joint = model_->body_jntadr[body.index];
      body.position = model_->jnt_qposadr[joint];
      body.speed = model_->jnt_dofadr[joint];
    }
    bodies_.emplace(def.id, body);
    SetState(def.id, def.initial);
  }
  return absl::OkStatus();
}

absl::Status MujocoEngine::Compile(const std::string& text) {
  constexpr const char* kFile = "scene.xml";
  auto files = std::make_unique<mjVFS>();
  mj_defaultVFS(files.get());
  mj_makeEmptyFileVFS(files.get(), kFile, static_cast<int>(text.size()));
  std::memcpy(files->filedata[mj_findFileVFS(files.get(), kFile)], text.data(), text.size());
  char error[1024] = "";
  model_ = mj_loadXML(kFile, files.get(), error, sizeof(error));
  mj_deleteVFS(files.get());
  if (model_ == nullptr) return absl::InternalError(fmt::format("mujoco: {}", error));
  if (config_.rk4) model_->opt.integrator = mjINT_RK4;
  data_ = mj_makeData(model_);
  return absl::OkStatus();
}

void MujocoEngine::Step(double dt_s) {
  const int steps = std::max(config_.substeps, 1);
  model_->opt.timestep = dt_s / steps;
  for (int i = 0; i < steps && !blown_up_; ++i) {
    mj_step(model_, data_);
    for (const int warning : {mjWARN_BADQPOS, mjWARN_BADQVEL, mjWARN_BADQACC}) {
      blown_up_ = blown_up_ || data_->warning[warning].number > 0;
    }
  }
  mju_zero(data_->xfrc_applied, 6 * model_->nbody);
}

void MujocoEngine::ApplyForce(BodyId id, Vec3f force_n, Vec3f torque_nm) {
  mjtNum* applied = data_->xfrc_applied + 6 * bodies_.at(id).index;
  const double pushes[6] = {force_n.x, force_n.y, force_n.z, torque_nm.x, torque_nm.y, torque_nm.z};
  for (int i = 0; i < 6; ++i) applied[i] += pushes[i];
}

// A free joint's linear velocity is in world coordinates, its angular velocity in the body's.
void MujocoEngine::SetState(BodyId id, const BodyState& state) {
  const Body& body = bodies_.at(id);
  if (!body.dynamic) return;
  const Quatd q = Normalized(state.orientation);
  const double pose[7] = {state.position.x, state.position.y, state.position.z, q.w, q.x, q.y, q.z};
  std::copy(std::begin(pose), std::end(pose), data_->qpos + body.position);
  const Vec3d v = Vec3d(state.linear_velocity), w = Rotate(Conjugate(q), Vec3d(state.angular_velocity));
  const double speed[6] = {v.x, v.y, v.z, w.x, w.y, w.z};
  std::copy(std::begin(speed), std::end(speed), data_->qvel + body.speed);
}

BodyState MujocoEngine::StateOf(BodyId id) const {
  const Body& body = bodies_.at(id);
  if (!body.dynamic) return body.initial;
  const mjtNum *p = data_->qpos + body.position, *v = data_->qvel + body.speed;
  BodyState state;
  if (blown_up_) {
    state.position.x = std::numeric_limits<double>::quiet_NaN();
    return state;
  }
  state.position = {p[0], p[1], p[2]};
  state.orientation = Normalized(Quatd{p[4], p[5], p[6], p[3]});
  state.linear_velocity = Vec3f(Vec3d{v[0], v[1], v[2]});
  state.angular_velocity = Vec3f(Rotate(state.orientation, Vec3d{v[3], v[4], v[5]}));
  return state;
}

}  // namespace

std::unique_ptr<Engine> MakeMujocoEngine(const EngineConfig& config) { return std::make_unique<MujocoEngine>(config); }

}  // namespace tessera::bench
