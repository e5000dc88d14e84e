// Connected joints, and a chain that needs them solved as one.
#include "core/physics/solve/joint_forest.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "core/physics/world.h"
#include "scenes/measured/builder.h"
#include "scenes/measured/linkages.h"

namespace tessera::physics {
namespace {

Vec3f Axis(int k) { return {k == 0 ? 1.0f : 0, k == 1 ? 1.0f : 0, k == 2 ? 1.0f : 0}; }

// Round bodies of the given masses, connected at points; the last one is the world.
class ConnectedBodies {
 public:
  explicit ConnectedBodies(std::vector<float> masses) : masses_(std::move(masses)), states(masses_.size() + 1) {
    for (std::size_t i = 0; i < masses_.size(); ++i) {
      const auto t = static_cast<float>(i);
      for (int k = 0; k < 3; ++k) {
        states[i].velocity[k] = std::sin(3 * t + static_cast<float>(k));
        states[i].spin[k] = std::cos(2 * t - static_cast<float>(k));
      }
    }
  }
  std::uint32_t world() const { return static_cast<std::uint32_t>(masses_.size()); }

  void Connect(std::uint32_t a, std::uint32_t b) {
    JointBlock& block = blocks.emplace_back();
    block.a = a;
    block.b = b;
    block.locked = block.count = 3;
    const auto n = static_cast<float>(a + b) * 0.3f;
    const Vec3f arm_a{0.5f, 0.1f * n, -0.2f}, arm_b{-0.5f, 0.3f, 0.05f * n};
    for (int k = 0; k < 3; ++k) {
      JointRow& row = block.rows[static_cast<std::size_t>(k)];
      const float root_a = Root(a), root_b = Root(b);
      row.linear_a = Axis(k) * -root_a;
      row.angular_a = Cross(arm_a, Axis(k)) * -root_a;
      row.linear_b = Axis(k) * root_b;
      row.angular_b = Cross(arm_b, Axis(k)) * root_b;
    }
  }

  void Grow() {
    order_.resize(blocks.size());
    std::iota(order_.begin(), order_.end(), 0u);
    forest.Grow(blocks, order_, world());
  }

  float Velocity(const JointRow& row, const JointBlock& block) const {
    const auto along = [&](std::uint32_t body, Vec3f linear, Vec3f angular) {
      const SolvedState& s = states[body];
      return Dot(linear, Vec3f{s.velocity[0], s.velocity[1], s.velocity[2]}) +
             Dot(angular, Vec3f{s.spin[0], s.spin[1], s.spin[2]});
    };
    return along(block.a, row.linear_a, row.angular_a) + along(block.b, row.linear_b, row.angular_b);
  }
  float Fastest() const {
    float fastest = 0;
    for (const JointBlock& block : blocks) {
      for (std::size_t i = 0; i < 3; ++i) fastest = std::max(fastest, std::abs(Velocity(block.rows[i], block)));
    }
    return fastest;
  }

  void Solve() {
    forest.Factor(blocks);
    for (JointBlock& block : blocks) {
      for (std::size_t i = 0; i < 3; ++i) block.wanted[i] = Velocity(block.rows[i], block);
    }
    forest.Solve(blocks);
    forest.Push(blocks, states.data());
  }

 private:
  float Root(std::uint32_t body) const { return body == world() ? 0 : 1 / std::sqrt(masses_[body]); }

  std::vector<float> masses_;
  std::vector<std::uint32_t> order_;

 public:
  std::vector<SolvedState> states;
  std::vector<JointBlock> blocks;
  JointForest forest;
};

TEST(JointForestTest, StopsEveryRowOfATreeInOneGo) {
  ConnectedBodies bodies({1, 2, 1000, 1, 5, 0.5f, 1, 300});
  for (const auto& [a, b] : {std::pair{0u, 1u}, {1u, 2u}, {3u, 1u}, {3u, 4u}, {5u, 3u}, {6u, 0u}, {6u, 7u}}) {
    bodies.Connect(a, b);
  }
  bodies.Grow();
  const float before = bodies.Fastest();
  bodies.Solve();
  EXPECT_GT(before, 0.5f);
  EXPECT_LT(bodies.Fastest(), 2e-6f * before);
}

TEST(JointForestTest, HangsATreeOnTheWorld) {
  ConnectedBodies bodies({1, 1, 1, 1000});
  bodies.Connect(0, bodies.world());
  for (std::uint32_t i = 0; i < 3; ++i) bodies.Connect(i, i + 1);
  bodies.Grow();
  const float before = bodies.Fastest();
  bodies.Solve();
  EXPECT_LT(bodies.Fastest(), 2e-6f * before);
}

TEST(JointForestTest, LeavesAloneWhatClosesACycleOrHasNoNeighbour) {
  ConnectedBodies bodies({1, 1, 1, 1, 1, 1});
  bodies.Connect(0, 1);
  bodies.Connect(1, 2);
  bodies.Connect(2, 0);               // closes a cycle
  bodies.Connect(3, 4);               // alone
  bodies.Connect(5, bodies.world());  // alone too: the world is no neighbour
  bodies.Grow();
  std::vector<bool> in_tree;
  for (const JointBlock& block : bodies.blocks) in_tree.push_back(block.in_tree);
  EXPECT_EQ(in_tree, (std::vector<bool>{true, true, false, false, false}));
}

TEST(JointForestTest, DoesTheSameInAnyCompany) {
  const auto solved = [](bool company) {
    ConnectedBodies bodies({1, 20, 1, 7, 1});
    bodies.Connect(0, 1);
    if (company) bodies.Connect(3, bodies.world());
    bodies.Connect(1, 2);
    if (company) bodies.Connect(4, 3);
    bodies.Grow();
    bodies.Solve();
    return std::vector<float>{bodies.states[0].velocity[0], bodies.states[1].spin[1], bodies.states[2].velocity[2]};
  };
  EXPECT_EQ(solved(false), solved(true));
}

// A chain that is hung up level and let go swings like a whip; the world chooses the substeps.
TEST(JointForestTest, HoldsAChainWithAHeavyEndTogether) {
  for (const double ratio : {1.0, 100.0, 1000.0}) {
    const scenes::Chain chain = scenes::BallAndChain(ratio);
    World world({.gravity_m_s2 = chain.scene.gravity_m_s2});
    for (const BodyDef& body : chain.scene.bodies) world.Add(body, body.initial);
    for (const JointDef& joint : chain.scene.joints) world.AddJoint(joint);
    double widest = 0;
    for (int i = 0; i < 180; ++i) {
      world.Step(1.0 / 60);
      for (const JointDef& joint : chain.scene.joints) {
        const BodyState a = world.StateOf(joint.body_a);
        const BodyState b = joint.body_b == BodyId() ? BodyState() : world.StateOf(joint.body_b);
        widest = std::max(widest, scenes::GapOf(joint, a, joint.body_b == BodyId() ? nullptr : &b));
      }
    }
    EXPECT_LT(widest, 0.005) << ratio;
  }
}

}  // namespace
}  // namespace tessera::physics
