#include "bench/engine.h"

#include "bench/engine_parts.h"
#include "bench/thread_cpu.h"

namespace tessera::bench {

bool EngineBuilt(EngineKind kind) {
  switch (kind) {
    case EngineKind::kTessera:
    case EngineKind::kBullet:
      return true;
    case EngineKind::kOde:
#ifdef TESSERA_BENCH_ODE
      return true;
#else
      return false;
#endif
    case EngineKind::kMujoco:
#ifdef TESSERA_BENCH_MUJOCO
      return true;
#else
      return false;
#endif
    case EngineKind::kBox3d:
#ifdef TESSERA_BENCH_BOX3D
      return true;
#else
      return false;
#endif
    case EngineKind::kJolt:
#ifdef TESSERA_BENCH_JOLT
      return true;
#else
      return false;
#endif
  }
  return false;
}

std::string_view EngineName(EngineKind kind) {
  switch (kind) {
    case EngineKind::kTessera:
      return "tessera";
    case EngineKind::kBullet:
      return "bullet";
    case EngineKind::kOde:
      return "ode";
    case EngineKind::kMujoco:
      return "mujoco";
    case EngineKind::kBox3d:
      return "box3d";
    case EngineKind::kJolt:
      return "jolt";
  }
  return "";
}

std::string_view EngineCommit(EngineKind kind) {
#ifdef TESSERA_BENCH_BOX3D
  if (kind == EngineKind::kBox3d) return TESSERA_BENCH_BOX3D;
#endif
#ifdef TESSERA_BENCH_JOLT
  if (kind == EngineKind::kJolt) return TESSERA_BENCH_JOLT;
#endif
  static_cast<void>(kind);
  return "";
}

std::unique_ptr<Engine> MakeEngine(EngineKind kind, const EngineConfig& config) {
  switch (kind) {
    case EngineKind::kTessera:
      return MakeTesseraEngine(config);
    case EngineKind::kBullet:
      return MakeBulletEngine(config);
    case EngineKind::kOde:
#ifdef TESSERA_BENCH_ODE
      return MakeOdeEngine(config);
#else
      return nullptr;
#endif
    case EngineKind::kMujoco:
#ifdef TESSERA_BENCH_MUJOCO
      return MakeMujocoEngine(config);
#else
      return nullptr;
#endif
    case EngineKind::kBox3d:
#ifdef TESSERA_BENCH_BOX3D
      return MakeBox3dEngine(config);
#else
      return nullptr;
#endif
    case EngineKind::kJolt:
#ifdef TESSERA_BENCH_JOLT
      return MakeJoltEngine(config);
#else
      return nullptr;
#endif
  }
  return nullptr;
}

double TimedStep(Engine& engine, double dt_s) {
  const double before = ThreadCpuSeconds();
  engine.Step(dt_s);
  return ThreadCpuSeconds() - before;
}

}  // namespace tessera::bench
