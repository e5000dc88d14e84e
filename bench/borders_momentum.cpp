// Momentum, linear and angular, that borders make or lose: what all bodies have, less what they had, less what gravity
// and static bodies gave, less what the two sides of a border found different in the last step, which they make up in
// the next, and plus what is still owed of earlier ones to bodies that still touch.
#include <fmt/format.h>

#include <algorithm>

#include "bench/borders_stage.h"
#include "core/physics/world.h"

namespace tessera::bench {
namespace {

constexpr double kMomentumCell_m = 20;

struct Sums {
  Vec3d linear, angular;
  double scale = 0, angular_scale = 0;  // sum of abs(p), and of abs(p) times its distance from the middle
};

class MomentumCheck {
 public:
  MomentumCheck(const CutScene& cut, const Manner& manner) : instance_(Start(cut, manner)) {
    for (const BodyDef& body : cut.scene->bodies) {
      if (body.motion == Motion::kDynamic) dynamic_.push_back(&body);
    }
    const auto regions = instance_->regions();
    for (const BodyDef* body : dynamic_) {
      for (const region::Region* region : regions) {
        if (region->Owns(body->id)) inertia_.push_back(region->world().InertiaOf(body->id));
      }
    }
    first_ = Of();
  }

  void Ticks(int n) {
    for (int i = 0; i < n; ++i) {
      // As the solver has them: in 60 s a seventh digit comes to as much as is looked for.
      const double dt = static_cast<double>(1.0F / static_cast<float>(instance_->scene().tick_rate_hz));
      const Vec3d gravity(Vec3f(instance_->scene().gravity_m_s2));
      for (const BodyDef* body : dynamic_) {
        const BodyState state = instance_->StateOf(body->id);
        Give(state.position + Vec3d(state.linear_velocity) * (dt / 2), gravity * (body->mass_kg * dt), {});
      }
      instance_->Tick();
      due_ = {};
      for (const region::Region* region : instance_->regions()) {
        TakeContacts(*region);
        TakeOwed(*region);
      }
      largest_ = std::max(largest_, Of().scale);
    }
  }

  double Drift() const { return Length(Of().linear - first_.linear - given_.linear - due_.linear) / Scale(); }
  double AngularDrift() const {
    return Length(Of().angular - first_.angular - given_.angular - due_.angular) / AngularScale();
  }
  double UnderWay() const { return Length(due_.linear) / Scale(); }
  std::uint64_t handovers() const { return instance_->handovers(); }

 private:
  Sums Of() const {
    Sums sums;
    for (std::size_t i = 0; i < dynamic_.size(); ++i) {
      const BodyState state = instance_->StateOf(dynamic_[i]->id);
      const Vec3d p = Vec3d(state.linear_velocity) * dynamic_[i]->mass_kg;
      sums.linear += p;
      sums.angular += Cross(state.position, p) + Spin(state, inertia_[i]);
      sums.scale += Length(p);
      sums.angular_scale += Length(p) * Length(Vec3d{state.position.x, state.position.y - 1, state.position.z});
    }
    return sums;
  }
  static Vec3d Spin(const BodyState& state, Vec3d inertia) {
    const Vec3d w = Rotate(Conjugate(state.orientation), Vec3d(state.angular_velocity));
    return Rotate(state.orientation, Vec3d{inertia.x * w.x, inertia.y * w.y, inertia.z * w.z});
  }
  double Scale() const { return std::max(first_.scale, largest_); }
  double AngularScale() const { return first_.scale > 0 ? first_.angular_scale : largest_; }

  void Give(Vec3d at, Vec3d impulse, Vec3d angular) {
    given_.linear += impulse;
    given_.angular += Cross(at, impulse) + angular;
  }
  // Each owner's account of what the ground and walls did to its bodies, and of what it let others' bodies do to them:
  // The two accounts of a pair across a border cancel but for what is still due.
  void TakeContacts(const region::Region& region) {
    for (const physics::Contact& contact : region.world().contacts()) {
      const bool owns_a = region.Owns(contact.body_a), owns_b = region.Owns(contact.body_b);
      if (owns_a == owns_b) continue;
      const BodyId id = owns_a ? contact.body_a : contact.body_b, other = owns_a ? contact.body_b : contact.body_a;
      const Vec3d impulse = Vec3d(contact.impulse_on_b) * (owns_a ? -1.0 : 1.0);
      const Vec3d angular(owns_a ? contact.angular_impulse_on_a : contact.angular_impulse_on_b);
      const Vec3d at = instance_->StateOf(id).position;
      if (region.world().MassOf(other) == 0) {
        Give(at, impulse, angular);
      } else {
        due_.linear += impulse;
        due_.angular += Cross(at, impulse) + angular;
      }
    }
  }

  // Bodies alone: the owner pays what its ghost is owed.
  void TakeOwed(const region::Region& region) {
    for (const region::OwedImpulse& owed : region.owed()) {
      if (!region.Owns(owed.id)) continue;
      due_.linear -= owed.impulse_ns;
      due_.angular -= Cross(owed.at, owed.impulse_ns) + owed.angular_nms;
    }
  }

  std::unique_ptr<BorderInstance> instance_;
  std::vector<const BodyDef*> dynamic_;
  std::vector<Vec3d> inertia_;
  Sums first_, given_, due_;
  double largest_ = 0;
};

void Measure(BorderStage& stage, const std::string& name, const Scene& scene,
             std::initializer_list<std::uint32_t> counts, bool closed, double seconds) {
  for (const std::uint32_t regions : counts) {
    BorderStage::Progress(fmt::format("{}, {} regions", name, regions));
    const Manner manner = Regions(regions);
    MomentumCheck check(CutBy(scene, regions, kMomentumCell_m), manner);
    check.Ticks(static_cast<int>(60 * seconds));
    stage.Note(name, manner.name, "momentum_drift", check.Drift());
    if (!closed) stage.Note(name, manner.name, "angular_momentum_drift", check.AngularDrift());
    stage.Note(name, manner.name, "momentum_under_way", check.UnderWay());
    stage.Note(name, manner.name, "handovers", static_cast<double>(check.handovers()));
  }
}

double WatchedSeconds(const BorderStage& stage) { return stage.Few(60, 5); }

void BallRows(BorderStage& stage) {
  for (const double restitution : {0.0, 1.0}) {
    for (const double gap : {0.0, 0.05}) {
      Measure(stage, fmt::format("ball row e={} gap={}", restitution, gap), scenes::BallRow(restitution, gap),
              {1, 2, 4, 9}, false, WatchedSeconds(stage));
    }
  }
}
void Blocks(BorderStage& stage) {
  Measure(stage, "colliding blocks", scenes::CollidingBlocks(), {1, 2, 4, 9}, false, WatchedSeconds(stage));
}
void Rain(BorderStage& stage) {
  Measure(stage, "rain in a box", scenes::RainInBox(stage.Few(200, 60)), {1, 2, 4}, true, WatchedSeconds(stage));
}
// Walls of a box that stands are outside the system; a box that floats is part of it, and its angular momentum counts.
void Floating(BorderStage& stage) {
  Measure(stage, "rain in a floating box", scenes::FloatingBox(stage.Few(200, 60)), {1, 2, 4}, false,
          WatchedSeconds(stage));
}

// The momentum of the first ball arrives beyond the border.
void Cradle(BorderStage& stage) {
  const Scene scene = scenes::BallRow(1, 0);
  Measure(stage, "cradle", scene, {1, 2, 4}, false, WatchedSeconds(stage));
  for (const std::uint32_t regions : {1U, 2U, 4U}) {
    const Manner manner = Regions(regions);
    const auto instance = Start(CutBy(scene, regions, kMomentumCell_m), manner);
    instance->Ticks(120);
    double arrived = 0;
    for (std::uint64_t id = 4; id <= 6; ++id)
      arrived += static_cast<double>(instance->StateOf(BodyId(id)).linear_velocity.x);
    stage.Note("cradle", manner.name, "momentum_arrived", arrived / 5);
  }
}

}  // namespace

std::vector<BorderCheck> MomentumChecks() {
  return {{"ball row", BallRows},
          {"cradle", Cradle},
          {"colliding blocks", Blocks},
          {"rain in a box", Rain},
          {"floating box", Floating}};
}

}  // namespace tessera::bench
