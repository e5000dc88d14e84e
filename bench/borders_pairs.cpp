// Two bodies that meet on a border, one of each region: the largest difference of velocity from one world.
#include <fmt/format.h>

#include <algorithm>

#include "bench/borders_stage.h"
#include "scenes/measured/builder.h"

namespace tessera::bench {
namespace {

using scenes::BallOf;
using scenes::BoxOf;
using scenes::CapsuleOf;

constexpr int kPairTicks = 90;
constexpr double kPairCell_m = 20;

struct Form {
  const char* name;
  ShapePtr shape;
};

std::vector<Form> Forms() {
  return {{"sphere", BallOf(0.5)},
          {"box", BoxOf(0.5, 0.5, 0.5)},
          {"capsule", CapsuleOf(0.3, 0.4)},
          {"cylinder", scenes::CylinderOf(0.5, 0.4)},
          {"cone", std::make_shared<const Shape>(Shape{ConeShape{0.5, 1}})},
          {"hull", scenes::HullOf({{-0.5F, -0.4F, -0.4F}, {0.5F, -0.4F, -0.4F}, {0, 0.6F, 0}, {0, -0.4F, 0.6F}})}};
}

double LargestError(const CutScene& one, const CutScene& cut, const Manner& manner) {
  const auto whole = Start(one, Regions(1)), parts = Start(cut, manner);
  double largest = 0;
  for (int i = 0; i < kPairTicks; ++i) {
    whole->Tick();
    parts->Tick();
    for (const BodyId id : {BodyId(1), BodyId(2)}) {
      const BodyState a = whole->StateOf(id), b = parts->StateOf(id);
      largest = std::max({largest, static_cast<double>(Length(a.linear_velocity - b.linear_velocity)),
                          static_cast<double>(Length(a.angular_velocity - b.angular_velocity))});
    }
  }
  return largest;
}

void Pairs(BorderStage& stage) {
  const std::vector<Form> forms = Forms();
  for (std::size_t a = 0; a < forms.size(); ++a) {
    for (std::size_t b = a; b < forms.size(); ++b) {
      const std::string scene = fmt::format("pair {} {}", forms[a].name, forms[b].name);
      for (const bool shared : {true, false}) {
        double worst = 0;
        for (const double ratio : {1.0, 30.0}) {
          for (const bool oblique : {false, true}) {
            const Scene pair = scenes::CollidingPair(forms[a].shape, forms[b].shape, ratio, oblique);
            Manner manner = Regions(2);
            manner.settings.shared_origin = shared;
            worst = std::max(worst, LargestError(CutBy(pair, 1, kPairCell_m), CutBy(pair, 2, kPairCell_m), manner));
          }
        }
        stage.Note(scene, shared ? "regions=2 origin=shared" : "regions=2 origin=own", "pair_velocity_error", worst,
                   "m/s");
      }
    }
  }
}

}  // namespace

std::vector<BorderCheck> PairChecks() { return {{"pairs", Pairs}}; }

}  // namespace tessera::bench
