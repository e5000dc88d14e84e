// Penetration: how deep the bodies of a scene stand in each other, by one yardstick for all engines: shapes as the
// scene states them, poses as the engine gives them.
//
//   Yardstick yardstick(scene);
//   Penetration now = yardstick.Measure(StatesOf(*engine, scene));
//
// A mesh is solid to half a metre below its triangles; height fields are not measured. Pairs that a joint exempts and
// triggers do not count. Thread rule: any thread; const calls may run at the same time.
#pragma once

#include <set>
#include <span>
#include <utility>
#include <vector>

#include "bench/engine.h"
#include "bench/solid.h"
#include "core/world/scene.h"

namespace tessera::bench {

struct Penetration {
  double deepest_m = 0;
  BodyId deepest_a, deepest_b;  // the deepest pair; none if nothing penetrates
  double sum_m = 0;             // over pairs, of the depth of each
  double sum_of_squares_m2 = 0;
  std::size_t pairs = 0;  // that penetrate
  double mean_per_body_m =
      0;  // sum over the number of dynamic bodies, so that more pairs at depth 0 make no difference
};

// In the order of scene.bodies.
std::vector<BodyState> StatesOf(const Engine& engine, const Scene& scene);

class Yardstick {
 public:
  explicit Yardstick(const Scene& scene);
  // `states` in the order of the scene's bodies.
  Penetration Measure(std::span<const BodyState> states) const;

 private:
  struct Part {  // a whole body, or one child of a compound
    std::size_t body;
    Solid solid;  // in the body's frame, at its centre of mass; in world space for a mesh's triangle
    bool placed = false;
  };
  struct Plane {
    std::size_t body;
    Vec3d normal;
    double offset_m;
  };
  struct Placed;

  void AddShape(std::size_t body, const BodyDef& def);
  std::vector<Placed> Place(std::span<const BodyState> states) const;
  bool Meet(std::size_t a, std::size_t b) const;

  std::vector<Part> parts_;
  std::vector<Plane> planes_;
  std::vector<BodyId> ids_;
  std::vector<bool> dynamic_;
  std::size_t dynamic_count_ = 0;
  std::set<std::pair<BodyId, BodyId>> exempt_;
};

}  // namespace tessera::bench
