#include "core/world/state_check.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/world/limits.h"

namespace tessera {
namespace {

constexpr BodyId kBody{7};

std::string Error(const BodyState& state) {
  const absl::Status status = CheckState(kBody, state);
  EXPECT_EQ(status.ok(), IsSane(state)) << status;  // one rule
  return std::string(status.message());
}

BodyState At(Vec3d position) {
  BodyState state;
  state.position = position;
  return state;
}

TEST(StateCheckTest, TakesWhatIsAtTheLimits) {
  BodyState state = At({kMaxStatePosition_m, -kMaxStatePosition_m, 0});
  state.orientation = {0, 0.6, 0, -0.8};
  state.linear_velocity = {static_cast<float>(kMaxStateSpeed_m_s), 0, 0};
  state.angular_velocity = {0, static_cast<float>(-kMaxStateAngularSpeed_rad_s), 0};
  state.angular_momentum = {0, 0, 1e26F};
  state.still_s = 1e9F;
  EXPECT_EQ(Error(state), "");
}

TEST(StateCheckTest, NamesTheFirstComponentThatIsWrong) {
  EXPECT_EQ(Error(At({0, 1e30, 2e30})), "body 7: position.y must be -1e+08 to 1e+08, got 1e+30");
  EXPECT_EQ(Error(At({0, 0, std::nan("")})), "body 7: position.z must be a finite number, got nan");
  EXPECT_EQ(Error(At({-HUGE_VAL, 0, 0})), "body 7: position.x must be a finite number, got -inf");
}

TEST(StateCheckTest, AnOrientationIsAUnitQuaternion) {
  BodyState state;
  state.orientation = {0, 0, 0, 0};
  EXPECT_EQ(Error(state), "body 7: orientation must be of length 1, got 0");
  state.orientation = {std::nan(""), 0, 0, 1};
  EXPECT_EQ(Error(state), "body 7: orientation must be a finite number, got nan");
}

TEST(StateCheckTest, NamesEveryFieldOfMotion) {
  BodyState state;
  state.linear_velocity.x = 2e6F;
  EXPECT_EQ(Error(state), "body 7: linear_velocity.x must be -100000 to 100000, got 2e+06");
  state = BodyState();
  state.angular_velocity.z = std::nanf("");
  EXPECT_EQ(Error(state), "body 7: angular_velocity.z must be a finite number, got nan");
  state = BodyState();
  state.angular_momentum.y = HUGE_VALF;
  EXPECT_EQ(Error(state), "body 7: angular_momentum.y must be a finite number, got inf");
  state = BodyState();
  state.still_s = -1;
  EXPECT_EQ(Error(state), "body 7: still_s must be >= 0, got -1");
}

TEST(StateCheckTest, ForcesAndImpulsesAreHeldToTheirLimits) {
  EXPECT_TRUE(CheckForce(kBody, {1e15F, 0, 0}, {0, -1e15F, 0}).ok());
  EXPECT_EQ(CheckForce(kBody, {0, 1e30F, 0}, {}).message(), "body 7: force_n.y must be -1e+15 to 1e+15, got 1e+30");
  EXPECT_EQ(CheckForce(kBody, {}, {std::nanf(""), 0, 0}).message(),
            "body 7: torque_nm.x must be a finite number, got nan");
  EXPECT_TRUE(IsSaneImpulse({1e14F, 0, 0}));
  EXPECT_FALSE(IsSaneImpulse({0, 0, 1e30F}));
  EXPECT_FALSE(IsSaneAngularImpulse({0, std::nanf(""), 0}));
}

}  // namespace
}  // namespace tessera
