// Engine: one physics engine as a benchmark sees it. The same scene goes into each; states come out of each.
//
//   std::unique_ptr<Engine> engine = MakeEngine(EngineKind::kBullet, {.iterations = 10});
//   if (absl::Status status = engine->Load(scene); !status.ok()) ...  // this engine lacks what the scene needs
//   const double seconds = TimedStep(*engine, 1.0 / 60);
//   Vec3d position = engine->StateOf(BodyId(7)).position;
//
// The bodies are the same in every engine: masses, moments of inertia, shapes and each pair's friction and restitution
// are those that Tessera documents (core/world/scene.h), so what differs is method. Everything else is as the engine
// comes. Errors (penetration, energy, drift) are computed from states alone, by one yardstick for all.
//
// Thread rule: one thread at a time.
#pragma once

#include <memory>
#include <string_view>

#include "absl/status/status.h"
#include "core/world/scene.h"

namespace tessera::bench {

enum class EngineKind {
  kTessera,  // physics::World
  kBullet,   // stock: btDiscreteDynamicsWorld as a game sets it up; float
  kOde,      // optional at build time; double
  kMujoco,   // optional at build time; double; scenes without joints
  kBox3d,    // optional at build time; float; scenes without joints but point joints
  kJolt,     // optional at build time; float; scenes without joints
};

struct EngineConfig {
  // Tessera: of every island that is solved; 0: as many as each needs. Box3D: its own substeps; 0: 4. The others:
  // Step(dt) is so many steps; 0: one.
  int substeps = 0;
  int iterations = 0;   // solver iterations; 0: the engine's default
  int threads = 1;      // Tessera, Box3D, Jolt: that work on a step
  bool sleep = false;   // bodies may sleep, by the engine's own thresholds
  bool direct = false;  // ODE: the direct solver (dWorldStep) rather than the iterative (dWorldQuickStep)
  bool rk4 = false;     // MuJoCo: Runge and Kutta's integrator, which its manual has for energy, rather than Euler's
  Vec3d origin{};       // Tessera: of the region's local coordinates. The others know only the world's.
};

class Engine {
 public:
  virtual ~Engine() = default;
  virtual std::string_view name() const = 0;  // as in the column `engine`

  // Once, before anything else. Errors: UNIMPLEMENTED naming what this engine cannot do.
  virtual absl::Status Load(const Scene& scene) = 0;
  virtual void Step(double dt_s) = 0;

  virtual BodyState StateOf(BodyId id) const = 0;  // not finite once the engine has blown up
  virtual void SetState(BodyId id, const BodyState& state) = 0;
  // World frame, about the centre of mass; acts during the next Step, all of it, then is forgotten.
  virtual void ApplyForce(BodyId id, Vec3f force_n, Vec3f torque_nm) = 0;
};

// False for a peer whose library was absent at build time.
bool EngineBuilt(EngineKind kind);
std::string_view EngineName(EngineKind kind);
// The commit that a peer was built from, as far as the build was told (TESSERA_BOX3D_COMMIT, TESSERA_JOLT_COMMIT);
// empty for others.
std::string_view EngineCommit(EngineKind kind);
// Null if it was not built.
std::unique_ptr<Engine> MakeEngine(EngineKind kind, const EngineConfig& config);

// Steps, and returns the CPU time it took, s.
double TimedStep(Engine& engine, double dt_s);

}  // namespace tessera::bench
