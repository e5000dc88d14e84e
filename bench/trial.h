// Trial: one scene in one engine at one setting, stepped and timed.
//
//   absl::StatusOr<Run> run = Run::Start({.engine = EngineKind::kBullet, .hz = 120}, scene);
//   run->Seconds(20);
//   run->StateOf(id), run->cpu_us_per_tick();
//
// Only steps are timed, never what looks at their outcome. Thread rule: one thread at a time.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "bench/engine.h"

namespace tessera::bench {

struct Trial {
  EngineKind engine = EngineKind::kTessera;
  EngineConfig config;
  double hz = 60;  // steps a second
};

// "hz=60", "hz=240 substeps=4 iterations=10 direct": as in the column `config`. What is left to the engine is not said.
std::string ConfigName(const Trial& trial);

class Run {
 public:
  // Errors: what Engine::Load says; UNAVAILABLE if the engine was not built.
  static absl::StatusOr<Run> Start(const Trial& trial, const Scene& scene);

  void Steps(int n);
  // Rounded to whole steps.
  void Seconds(double seconds);
  // To the first end of a step that is not before this time since the start.
  void Until(double time_s);
  // To the next whole 1/60 s; one step if steps are longer.
  void Tick();
  // N, on this body in every step from now on.
  void Push(BodyId body, Vec3f force_n) { pushes_.push_back({body, force_n}); }

  BodyState StateOf(BodyId id) const { return engine_->StateOf(id); }
  Engine& engine() { return *engine_; }
  double time_s() const { return static_cast<double>(steps_) / hz_; }
  // CPU time of the steps so far, by simulated 1/60 s.
  double cpu_us_per_tick() const;

 private:
  struct Pushed {
    BodyId body;
    Vec3f force_n;
  };

  std::unique_ptr<Engine> engine_;
  std::vector<Pushed> pushes_;
  double hz_ = 60, cpu_s_ = 0;
  long steps_ = 0;
};

// All its numbers are finite.
bool IsFinite(const BodyState& state);

}  // namespace tessera::bench
