#include "bench/engine_parts.h"
#include "core/physics/world.h"

namespace tessera::bench {
namespace {

class TesseraEngine : public Engine {
 public:
  explicit TesseraEngine(const EngineConfig& config) : config_(config) {}
  std::string_view name() const override { return EngineName(EngineKind::kTessera); }

  absl::Status Load(const Scene& scene) override {
    if (!scene.fields.empty()) return Lacking(name(), "fields are the region's, not the engine's");
    physics::WorldSettings settings{.origin = config_.origin, .gravity_m_s2 = scene.gravity_m_s2};
    settings.substeps = config_.substeps;
    settings.threads = config_.threads;
    world_ = std::make_unique<physics::World>(settings);
    for (BodyDef body : scene.bodies) {
      body.may_sleep = body.may_sleep && config_.sleep;
      world_->Add(body, body.initial);
    }
    for (const JointDef& joint : scene.joints) world_->AddJoint(joint);
    return absl::OkStatus();
  }

  void Step(double dt_s) override { world_->Step(dt_s); }
  BodyState StateOf(BodyId id) const override { return world_->StateOf(id); }
  void SetState(BodyId id, const BodyState& state) override { world_->SetState(id, state); }
  void ApplyForce(BodyId id, Vec3f force_n, Vec3f torque_nm) override { world_->ApplyForce(id, force_n, torque_nm); }

 private:
  EngineConfig config_;
  std::unique_ptr<physics::World> world_;
};

}  // namespace

std::unique_ptr<Engine> MakeTesseraEngine(const EngineConfig& config) {
  return std::make_unique<TesseraEngine>(config);
}

}  // namespace tessera::bench
