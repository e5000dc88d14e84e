#include "core/physics/solve/solver.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <vector>

#include "core/physics/solve/coloring.h"
#include "core/physics/solve/contact_blocks.h"
#include "core/physics/solve/direct_contacts.h"
#include "core/physics/solve/impacts.h"
#include "core/physics/solve/joint_blocks.h"
#include "core/physics/solve/kernel.h"
#include "core/physics/solve/solved_access.h"
#include "core/physics/solve/tuning.h"

namespace tessera::physics {
namespace {

const Kernels& KernelsOf(SimdPath path) {
  const bool avx2 = __builtin_cpu_supports("avx2");
  return path == SimdPath::kSse2 || !avx2 ? KernelsSse2() : KernelsAvx2();
}

void Put(float (&to)[4], Vec3f v) {
  to[0] = v.x;
  to[1] = v.y;
  to[2] = v.z;
  to[3] = 0;
}
Vec3f Root(Vec3f v) { return {std::sqrt(v.x), std::sqrt(v.y), std::sqrt(v.z)}; }

}  // namespace

struct Solver::Impl {
  Impl(const Kernels& kernels_in, ThreadTeam& team_in) : kernels(kernels_in), team(team_in) {}

  void LoadBodies(std::span<const SolverBody> bodies, float h);
  void LoadBody(const SolverBody& body, std::size_t i, float h);
  void Kick(bool first);
  void Drift();
  void Run(ContactKernel ContactKernels::*kernel, const ContactStage& stage);
  void RunAll(ContactKernel ContactKernels::*kernel);
  void SolveAll(bool relax);
  void Substeps(int count);
  void StoreBodies(std::span<SolverBody> bodies);
  void StoreBody(std::size_t i, SolverBody& body) const;

  const Kernels& kernels;
  ThreadTeam& team;
  StepConstants step{};
  std::size_t count = 0;  // number of moving bodies; those after the last, one a thread, stand for the world
  // By body, and as long as the largest batch so far: one that shrank for a small batch would be cleared for the next.
  std::vector<SolvedState> states;
  std::vector<SolvedMass> masses;
  std::vector<SolvedMemory> before;  // velocities before the last kick
  std::vector<SolvedKick> kicks;
  Coloring coloring;
  ContactBlocks contacts;
  DirectContacts direct;
  JointBlocks joints;
  Impacts impacts;
};

void Solver::Impl::LoadBodies(std::span<const SolverBody> bodies, float h) {
  count = bodies.size();
  const std::size_t all = count + team.size();
  if (states.size() < all) {
    states.resize(all);
    masses.resize(all);
    before.resize(all);
    kicks.resize(all);
  }
  team.For(count, kChunkBodies, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) LoadBody(bodies[i], i, h);
  });
  for (std::size_t i = count; i < all; ++i) {
    states[i] = {};
    masses[i] = {};
    before[i] = {};
    kicks[i] = {};
  }
}

void Solver::Impl::LoadBody(const SolverBody& body, std::size_t i, float h) {
  const float root_mass = std::sqrt(body.mass_kg);
  const Vec3f root = Root(body.inertia_kg_m2);
  const SymMat3f root_inertia = Turned(body.rotation, root);
  const SymMat3f inverse = Turned(body.rotation, {1 / root.x, 1 / root.y, 1 / root.z});
  masses[i] = {{inverse.xx, inverse.yy, inverse.zz, inverse.xy, inverse.xz, inverse.yz}, 1 / root_mass, 0};
  states[i] = {};
  Put(states[i].velocity, body.velocity * root_mass);
  Put(states[i].spin, root_inertia * body.angular_velocity);
  Put(kicks[i].velocity, body.acceleration * (h * root_mass));
  Put(kicks[i].spin, (root_inertia * body.angular_acceleration) * h);
}

// A kick is the change of velocities by accelerations over a substep. The whole change that a substep made to a body is
// its kick plus all its impulses; so giving the body the same change once more is both the next kick and the warm
// start, and no constraint need be looked at.
void Solver::Impl::Kick(bool first) {
  team.For(count, kChunkBodies, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      SolvedState& state = states[i];
      for (int k = 0; k < 4; ++k) {
        const float v = state.velocity[k], w = state.spin[k];
        state.velocity[k] = first ? v + kicks[i].velocity[k] : v + (v - before[i].velocity[k]);
        state.spin[k] = first ? w + kicks[i].spin[k] : w + (w - before[i].spin[k]);
        before[i].velocity[k] = v;
        before[i].spin[k] = w;
      }
    }
  });
}

void Solver::Impl::Drift() {
  team.For(count, kChunkBodies, [&](std::size_t begin, std::size_t end) {
    kernels.drift(states.data() + begin, masses.data() + begin, end - begin, step.h);
  });
}

void Solver::Impl::Run(ContactKernel ContactKernels::*kernel, const ContactStage& stage) {
  if (team.IsPlain(stage.blocks, kChunkBlocks)) {
    for (const ContactRun& run : contacts.RunsOf(stage)) {
      (kernels.contacts[run.kind].*kernel)(contacts.BlocksOf(run), run.blocks, {states.data(), masses.data()}, step);
    }
    return;
  }
  team.For(stage.blocks, kChunkBlocks, [&](std::size_t begin, std::size_t end) {
    for (const ContactRun& run : contacts.RunsOf(stage)) {
      const std::size_t first = std::max<std::size_t>(begin, run.before);
      const std::size_t last = std::min<std::size_t>(end, run.before + run.blocks);
      if (first >= last) continue;
      (kernels.contacts[run.kind].*kernel)(contacts.BlocksOf(run, first - run.before), last - first,
                                           {states.data(), masses.data()}, step);
    }
  });
}

void Solver::Impl::RunAll(ContactKernel ContactKernels::*kernel) {
  for (const ContactStage& stage : contacts.stages()) Run(kernel, stage);
}

// Joints come before contacts, so that overlaps have the last word. Contacts are solved there and back: in one
// direction alone a wall of boxes gathers energy until it sways by centimetres. The order of colors alone is reversed;
// if that of the points of a contact were reversed as well, the wall would sway again.
void Solver::Impl::SolveAll(bool relax) {
  if (!joints.empty()) joints.Solve(states.data(), masses.data(), step, relax);
  if (!direct.empty() && !relax) direct.Solve(contacts, states, step, relax);
  RunAll(relax ? &ContactKernels::relax : &ContactKernels::solve);
  // Where bodies are by now is known only after the first pass of relaxing.
  if (!direct.empty() && relax) direct.Solve(contacts, states, step, relax);
  const std::span<const ContactStage> stages = contacts.stages();
  for (std::size_t i = stages.size(); i-- > 0;) {
    Run(relax ? &ContactKernels::settle : &ContactKernels::solve, stages[i]);
  }
}

void Solver::Impl::Substeps(int substeps) {
  for (int i = 0; i < substeps; ++i) {
    Kick(i == 0);
    if (i == 0) {
      joints.Warm(states.data());
      RunAll(&ContactKernels::warm);
    }
    if (!impacts.empty() &&
        impacts.Bounce(kernels, contacts, states.data(), masses.data(), before.data(), kicks.data(), step.h)) {
      RunAll(&ContactKernels::locate);
    }
    SolveAll(false);
    Drift();
    joints.Turn(states.data(), masses.data(), before.data(), step.h);
    SolveAll(true);
  }
}

void Solver::Impl::StoreBodies(std::span<SolverBody> bodies) {
  team.For(count, kChunkBodies, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) StoreBody(i, bodies[i]);
  });
}

void Solver::Impl::StoreBody(std::size_t i, SolverBody& body) const {
  const SymMat3f root_inertia = Turned(body.rotation, Root(body.inertia_kg_m2));
  const float* inverse = masses[i].root_inertia;
  const Vec3f spin = Get(states[i].spin);
  body.angular_impulse_nms = root_inertia * (spin - root_inertia * body.angular_velocity);
  body.velocity = Get(states[i].velocity) * masses[i].inverse_root_mass;
  body.angular_velocity = SymMat3f{inverse[0], inverse[1], inverse[2], inverse[3], inverse[4], inverse[5]} * spin;
  body.moved_m = Get(states[i].moved);
  body.turned_rad = Get(states[i].turned);
}

Solver::Solver(SimdPath path, ThreadTeam& team) : impl_(std::make_unique<Impl>(KernelsOf(path), team)) {}
Solver::~Solver() = default;

void Solver::Solve(const SolveBatch& batch) {
  assert(batch.substeps >= 1 && batch.dt_s > 0);
  const float h = batch.dt_s / static_cast<float>(batch.substeps);
  Impl& impl = *impl_;
  const float share = std::min(1.0f, static_cast<float>(kPushingSubsteps) / static_cast<float>(batch.substeps));
  impl.step = {h, 1 / h, kPushOut_m_s * share};
  impl.LoadBodies(batch.bodies, h);
  impl.coloring.Color(batch);
  const auto nobody = static_cast<std::uint32_t>(impl.count);
  impl.joints.Fill(batch.joints, impl.coloring, impl.states.data(), impl.masses.data(), nobody, h);
  impl.contacts.Fill(batch.contacts, impl.coloring, nobody, h, impl.team);
  impl.RunAll(&ContactKernels::prepare);
  impl.direct.Clear();
  if (batch.bears) impl.direct.Fill(batch.contacts, impl.contacts, impl.masses);
  impl.impacts.Fill(batch.contacts, impl.count, impl.team.size());
  impl.Substeps(batch.substeps);
  impl.contacts.Store(batch.contacts, impl.states, impl.masses, impl.team);
  impl.StoreBodies(batch.bodies);
  impl.joints.Store(batch.joints);
}

}  // namespace tessera::physics
