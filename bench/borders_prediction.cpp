// How well a region knows a neighbour's body that it has not heard of for a while: one tick, 100 ms, 250 ms.
//
// Three ways: straight on (constant velocity), Algorithm 1 as extended (core/physics/prediction.h), and the region's
// own stepping of the ghost, which knows the contacts and joints that it sees. Truth is what the owner came to. The
// stepped ghost is stepped in a world that holds what the region had at that tick, its own bodies and ghosts, and
// nothing else.
#include <fmt/format.h>

#include <map>

#include "bench/borders_stage.h"
#include "bench/statistics.h"
#include "core/physics/prediction.h"
#include "core/physics/world.h"
#include "scenes/measured/builder.h"

namespace tessera::bench {
namespace {

using scenes::BallOf;
using scenes::BoxOf;
using scenes::Builder;

constexpr int kHorizons[] = {1, 6, 15};  // ticks
constexpr const char* kHorizonNames[] = {"1 tick", "100 ms", "250 ms"};
constexpr const char* kWays[] = {"constant velocity", "algorithm 1", "stepped"};

// Balls and boxes thrown over the border.
Scene Free() {
  Builder make("free");
  for (int i = 0; i < 12; ++i) {
    BodyDef& body = make.Dynamic(i % 2 == 0 ? BallOf(0.3) : BoxOf(0.3, 0.2, 0.4), {-3.0 + 0.3 * i, 5, -6.0 + i}, 1);
    body.initial.linear_velocity = {3, 4, 0};
    body.initial.angular_velocity = {1, 2, 0.5};
  }
  return make.Take();
}

// Balls that are thrown along the ground without spin, and come to roll on a ground that brakes them.
Scene Rolling() {
  Builder make("rolling");
  const Material rough{.friction = 0.5, .rolling_friction = 0.02};
  make.Ground(rough);
  for (int i = 0; i < 12; ++i) {
    make.Dynamic(BallOf(0.4), {-1.0 - 0.25 * i, 0.4, -6.0 + i}, 1, rough).initial.linear_velocity = {4, 0, 0};
  }
  return make.Take();
}

// Boxes that slide, and balls that roll, down a slope of 30 degrees over the border.
Scene Sloped() {
  Builder make("sloped");
  const scenes::SinCos at = scenes::SinCosOf(0.5236);
  const Vec3d up{at.sin, at.cos, 0}, down{at.cos, -at.sin, 0};
  make.Static(scenes::PlaneOf(up), {}, {.friction = 0.3});
  for (int i = 0; i < 12; ++i) {
    const Vec3d place = down * (-1.0 - 0.25 * i) + up * 0.3 + Vec3d{0, 0, -6.0 + i};
    BodyDef& body = make.Dynamic(i % 2 == 0 ? BallOf(0.3) : BoxOf(0.3, 0.3, 0.3), place, 1, {.friction = 0.3});
    body.initial.orientation = scenes::Turn({0, 0, 1}, -0.5236);
  }
  return make.Take();
}

// Chains that swing to and fro over the border.
Scene Jointed() {
  Builder make("jointed");
  for (int chain = 0; chain < 4; ++chain) {
    const Vec3d hook{-0.5, 6, -4.5 + 3.0 * chain};
    BodyId before;
    for (int i = 0; i < 5; ++i) {
      const Vec3d middle = hook - Vec3d{0.5 + i, 0, 0};
      const BodyId link = make.Dynamic(BoxOf(0.45, 0.1, 0.1), middle, 1).id;
      make.JointAt(link, before, Pose{hook - Vec3d{static_cast<double>(i), 0, 0}, {}}, PointJoint{});
      before = link;
    }
  }
  return make.Take();
}

// Balls and boxes that bounce on the ground and off each other about the border.
Scene Colliding() {
  Builder make("colliding");
  const Material bouncy{.friction = 0.3, .restitution = 0.5};
  make.Ground(bouncy);
  for (int i = 0; i < 64; ++i) {
    const double side = i % 2 == 0 ? -1 : 1;
    const Vec3d place{side * (1 + 0.8 * (i / 2 % 4)), 0.6 + 0.9 * (i / 32), -1.2 + 0.8 * (i / 8 % 4)};
    BodyDef& body = make.Dynamic(i % 3 == 0 ? BoxOf(0.3, 0.3, 0.3) : BallOf(0.35), place, 1, bouncy);
    body.initial.linear_velocity = {static_cast<float>(-2.5 * side), 1, static_cast<float>(i % 5) - 2};
  }
  return make.Take();
}

using States = std::map<BodyId, BodyState>;

States StatesOf(const BorderInstance& instance) {
  States states;
  for (const region::Region* region : instance.regions()) {
    for (const region::OwnedBody& body : region->owned()) states[body.def->id] = body.state;
  }
  return states;
}

// The bodies that a region had at a tick, which ones were others', and all that they were.
struct Sample {
  std::size_t tick = 0;
  std::vector<const BodyDef*> seen;
  std::vector<bool> ghost;
};

Sample SampleOf(const region::Region& region, const Scene& scene, std::size_t tick) {
  Sample sample{tick, {}, {}};
  for (const BodyDef& body : scene.bodies) {
    if (!region.world().Has(body.id)) continue;
    sample.seen.push_back(&body);
    sample.ghost.push_back(body.motion == Motion::kDynamic && !region.Owns(body.id));
  }
  return sample;
}

// Where each way says that a body will be so many ticks later, against where it was.
class Judgement {
 public:
  explicit Judgement(const Scene& scene) : scene_(scene), dt_s_(1.0 / scene.tick_rate_hz) {}

  void Add(const Sample& sample, const std::vector<States>& history) {
    physics::World world({.origin = {}, .gravity_m_s2 = scene_.gravity_m_s2});
    const States& now = history[sample.tick];
    for (const BodyDef* body : sample.seen) {
      world.Add(*body, body->motion == Motion::kStatic ? body->initial : now.at(body->id));
    }
    for (const JointDef& joint : scene_.joints) {
      if (world.Has(joint.body_a) && (joint.body_b == BodyId() || world.Has(joint.body_b))) world.AddJoint(joint);
    }
    int stepped = 0;
    for (std::size_t h = 0; h < std::size(kHorizons); ++h) {
      for (; stepped < kHorizons[h]; ++stepped) world.Step(dt_s_);
      const States& then = history[sample.tick + static_cast<std::size_t>(kHorizons[h])];
      for (std::size_t i = 0; i < sample.seen.size(); ++i) {
        if (sample.ghost[i]) AddBody(h, *sample.seen[i], now, then, world.StateOf(sample.seen[i]->id));
      }
    }
  }

  void Note(BorderStage& stage, const std::string& scene) const {
    for (std::size_t h = 0; h < std::size(kHorizons); ++h) {
      const double straight = Mean(errors_[0][h]);
      for (std::size_t way = 0; way < std::size(kWays); ++way) {
        const std::string config = fmt::format("{} {}", kWays[way], kHorizonNames[h]);
        stage.Note(scene, config, "prediction_error_mean", Mean(errors_[way][h]), "m");
        stage.Note(scene, config, "prediction_error_p95", Quantile(errors_[way][h], 0.95), "m");
        if (way > 0) stage.Note(scene, config, "predictor_error_ratio", Mean(errors_[way][h]) / straight);
      }
    }
    stage.Note(scene, kWays[2], "samples", static_cast<double>(errors_[0][0].size()));
  }

 private:
  void AddBody(std::size_t h, const BodyDef& def, const States& now, const States& then, const BodyState& stepped) {
    const BodyState &from = now.at(def.id), &to = then.at(def.id);
    const double t = kHorizons[h] * dt_s_;
    const Vec3d straight = from.position + Vec3d(from.linear_velocity) * t;
    const physics::Forces forces{scene_.gravity_m_s2 * def.gravity_scale};
    errors_[0][h].push_back(Length(straight - to.position));
    errors_[1][h].push_back(Length(physics::Predict(def, from, forces, t).position - to.position));
    errors_[2][h].push_back(Length(stepped.position - to.position));
  }
  static double Mean(const std::vector<double>& values) {
    double sum = 0;
    for (const double value : values) sum += value;
    return sum / static_cast<double>(values.size());
  }

  const Scene& scene_;
  double dt_s_;
  std::vector<double> errors_[std::size(kWays)][std::size(kHorizons)];
};

void Judge(BorderStage& stage, const std::string& name, Scene scene) {
  constexpr int kTicks = 150, kEvery = 5;
  const CutScene cut = CutBy(std::move(scene), 2, 20);
  const auto instance = Start(cut, Regions(2));
  std::vector<States> history{StatesOf(*instance)};
  std::vector<Sample> samples;
  const int last = kTicks + kHorizons[std::size(kHorizons) - 1];
  for (int tick = 1; tick <= last; ++tick) {
    instance->Tick();
    history.push_back(StatesOf(*instance));
    if (tick > kTicks || tick % (stage.quick() ? 3 * kEvery : kEvery) != 0) continue;
    for (const region::Region* region : instance->regions()) {
      samples.push_back(SampleOf(*region, *cut.scene, static_cast<std::size_t>(tick)));
    }
  }
  Judgement judgement(*cut.scene);
  for (const Sample& sample : samples) judgement.Add(sample, history);
  judgement.Note(stage, name);
}

void Predictor(BorderStage& stage) {
  Judge(stage, "predict free", Free());
  Judge(stage, "predict rolling", Rolling());
  Judge(stage, "predict sloped", Sloped());
  Judge(stage, "predict jointed", Jointed());
  Judge(stage, "predict colliding", Colliding());
}

}  // namespace

std::vector<BorderCheck> PredictorChecks() { return {{"predictor", Predictor}}; }

}  // namespace tessera::bench
