#include "core/region/frame.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "core/region/catalog.h"
#include "core/region/frame_check.h"
#include "core/region/testing/sample_frame.h"

namespace tessera::region {
namespace {

// A frame says the same if it encodes to the same bytes: the encoding holds every field.
TEST(FrameTest, ComesBackWithoutLoss) {
  const BorderFrame frame = SampleFrame();
  const std::vector<std::uint8_t> bytes = Encode(frame, {});
  const absl::StatusOr<BorderFrame> back = Decode(bytes, {});
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(Encode(*back, {}), bytes);
  EXPECT_EQ(back->tick, frame.tick);
  ASSERT_EQ(back->ghosts.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(back->ghosts[i].id, frame.ghosts[i].id);
    EXPECT_EQ(back->ghosts[i].epoch, frame.ghosts[i].epoch);
    EXPECT_TRUE(SameBits(back->ghosts[i].state, frame.ghosts[i].state));
    EXPECT_EQ(back->ghosts[i].force_n, frame.ghosts[i].force_n);
    EXPECT_EQ(back->ghosts[i].load_ns, frame.ghosts[i].load_ns);
    EXPECT_EQ(back->ghosts[i].load_nms, frame.ghosts[i].load_nms);
    EXPECT_EQ(back->ghosts[i].settled, frame.ghosts[i].settled);
    EXPECT_EQ(back->ghosts[i].externally_supported, frame.ghosts[i].externally_supported);
    EXPECT_EQ(back->ghosts[i].island_load, frame.ghosts[i].island_load);
    EXPECT_EQ(back->ghosts[i].torque_nm, frame.ghosts[i].torque_nm);
  }
  EXPECT_EQ(back->impulses[0].angular_on_other, frame.impulses[0].angular_on_other);
  EXPECT_EQ(back->grants[0].touching, frame.grants[0].touching);
  EXPECT_TRUE(SameBits(back->grants[0].bodies[1].state, frame.grants[0].bodies[1].state));
  EXPECT_EQ(back->grants[1].control.next.number, 12U);
  EXPECT_EQ(back->grants[1].control.queue[1].number, 15U);
  EXPECT_EQ(back->acknowledgements[0].epoch, Epoch(31));
  EXPECT_EQ(back->late_corrections[0].angular_nms, frame.late_corrections[0].angular_nms);
  EXPECT_EQ(back->inputs[0].number, 77U);
  EXPECT_EQ(back->inputs[0].player, PlayerNumber(4));
  EXPECT_EQ(DecodeHeader(bytes)->sender, RegionId(3));
}

TEST(FrameTest, ASleeperThatDidNotChangeCostsTwoBytesAtMost) {
  BorderFrame frame;
  frame.ghosts = {{BodyId(5), Epoch(200), SampleState(2, true), {}, {}, {}, {}}};
  const std::size_t empty = Encode(BorderFrame(), {}).size();
  const std::vector<std::uint8_t> bytes = Encode(frame, frame.ghosts);
  EXPECT_LE(bytes.size(), empty + 2);
  const absl::StatusOr<BorderFrame> back = Decode(bytes, frame.ghosts);
  ASSERT_TRUE(back.ok());
  EXPECT_TRUE(SameBits(back->ghosts[0].state, frame.ghosts[0].state));
  EXPECT_FALSE(Decode(bytes, {}).ok());
}

TEST(FrameTest, EveryTruncationIsRefused) {
  const std::vector<std::uint8_t> bytes = Encode(SampleFrame(), {});
  for (std::size_t n = 0; n < bytes.size(); ++n) {
    EXPECT_TRUE(absl::EndsWith(Decode(std::span(bytes).first(n), {}).status().message(), ": truncated"))
        << n << " bytes";
  }
  std::vector<std::uint8_t> longer = bytes;
  longer.push_back(0);
  EXPECT_EQ(Decode(longer, {}).status().message(), "trailing bytes");
}

TEST(FrameTest, ACountThatTheRestCannotHoldIsRefused) {
  // Format 15, tick, sender, map version, committed version, flags, number, no unchanged ghosts, then 2^63 ghosts.
  const std::vector<std::uint8_t> bytes{15,   0,    1,    1,    0,    0,    0,    0,    0x80,
                                        0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x01};
  EXPECT_EQ(Decode(bytes, {}).status().message(), "ghosts: truncated");
}

class FrameCheckTest : public ::testing::Test {
 protected:
  FrameCheckTest() {
    auto scene = std::make_shared<Scene>();
    for (std::uint64_t id = 1; id <= 6; ++id) {
      BodyDef def;
      def.id = BodyId(id);
      def.motion = id == 1 ? Motion::kStatic : Motion::kDynamic;
      scene->bodies.push_back(def);
    }
    JointDef joint;
    joint.id = JointId(1);
    joint.body_a = BodyId(2);
    joint.body_b = BodyId(3);
    joint.kind = PointJoint{};
    scene->joints.push_back(joint);
    scene->properties = {{"score", std::int64_t{0}}};
    catalog = std::make_unique<Catalog>(scene);
    frame.ghosts = {{BodyId(4), Epoch(1), SampleState(1), {}, {}, {}, {}}};
    Grant grant;
    grant.bodies = {{BodyId(2), Epoch(2), SampleState(1)}, {BodyId(3), Epoch(2), SampleState(1)}};
    frame.grants = {grant};
    frame.impulses = {{BodyId(4), BodyId(5), {}, {}, {}}};
  }
  std::string Error() const { return std::string(CheckFrame(frame, *catalog).message()); }

  std::unique_ptr<Catalog> catalog;
  BorderFrame frame;
};

TEST_F(FrameCheckTest, AcceptsAGoodFrame) { EXPECT_EQ(Error(), ""); }

TEST_F(FrameCheckTest, RefusesUnknownAndStaticBodies) {
  frame.ghosts[0].id = BodyId(77);
  EXPECT_EQ(Error(), "body 77 is not a dynamic body of the scene");
  frame.ghosts[0].id = BodyId(1);
  EXPECT_EQ(Error(), "body 1 is not a dynamic body of the scene");
  frame.ghosts[0].id = PlayerBodyId(PlayerNumber(1));  // the scene has no players
  EXPECT_NE(Error(), "");
}

TEST_F(FrameCheckTest, RefusesPropertiesThatNoGhostOfTheFrameCanHave) {
  frame.properties = {{BodyId(4), {0, 2}}};
  EXPECT_EQ(Error(), "");
  frame.properties = {{BodyId(4), {1, 2}}};
  EXPECT_EQ(Error(), "body 4: properties: not declared");
  frame.properties = {{BodyId(4), {0}}};
  EXPECT_EQ(Error(), "body 4: properties: truncated");
  frame.properties = {{BodyId(5), {0, 2}}};
  EXPECT_EQ(Error(), "body 5 has properties and is no ghost");
  frame.properties = {{BodyId(4), {0, 2}}, {BodyId(4), {0, 2}}};
  EXPECT_EQ(Error(), "body 4: bodies with properties do not ascend");
}

TEST_F(FrameCheckTest, RefusesStatesThatAreNotSane) {
  for (const double bad : {std::nan(""), HUGE_VAL, 1e9}) {
    frame.ghosts[0].state.position.y = bad;
    EXPECT_EQ(Error(), std::isfinite(bad) ? "body 4: position.y must be -1e+08 to 1e+08, got 1e+09"
                       : std::isnan(bad)  ? "body 4: position.y must be a finite number, got nan"
                                          : "body 4: position.y must be a finite number, got inf");
  }
  frame.ghosts[0].state = SampleState(1);
  frame.ghosts[0].state.orientation = {0, 0, 0, 0};
  EXPECT_NE(Error(), "");
  frame.ghosts[0].state = SampleState(1);
  frame.ghosts[0].state.angular_momentum.z = HUGE_VALF;
  EXPECT_NE(Error(), "");
  for (const float bad : {-1.0F, std::nanf(""), HUGE_VALF}) {
    frame.ghosts[0].state = SampleState(1);
    frame.ghosts[0].state.still_s = bad;
    EXPECT_NE(Error(), "");
  }
  frame.ghosts[0].state = SampleState(1);
  frame.grants[0].bodies[1].state.linear_velocity.x = 2e6F;
  EXPECT_EQ(Error(), "body 3: linear_velocity.x must be -100000 to 100000, got 2e+06");
}

// Whatever number of a body's state is absurd, that body and that number are named.
TEST_F(FrameCheckTest, NamesEveryNumberOfAStateThatIsAbsurd) {
  const auto errors = [this](const std::string& field, auto&& number_of) {
    for (const double bad : {std::nan(""), HUGE_VAL, -HUGE_VAL, 1e30, -1e30}) {
      for (const bool granted : {false, true}) {
        frame.ghosts[0].state = frame.grants[0].bodies[1].state = SampleState(1);
        BodyState& state = granted ? frame.grants[0].bodies[1].state : frame.ghosts[0].state;
        auto& number = number_of(state);
        number = static_cast<std::remove_reference_t<decltype(number)>>(bad);
        const std::string start = std::string(granted ? "body 3: " : "body 4: ") + field + " must be ";
        EXPECT_EQ(Error().substr(0, start.size()), start) << bad;
      }
    }
  };
  errors("position.x", [](BodyState& s) -> double& { return s.position.x; });
  errors("position.z", [](BodyState& s) -> double& { return s.position.z; });
  errors("orientation", [](BodyState& s) -> double& { return s.orientation.x; });
  errors("orientation", [](BodyState& s) -> double& { return s.orientation.w; });
  errors("linear_velocity.y", [](BodyState& s) -> float& { return s.linear_velocity.y; });
  errors("angular_velocity.z", [](BodyState& s) -> float& { return s.angular_velocity.z; });
  errors("angular_momentum.x", [](BodyState& s) -> float& { return s.angular_momentum.x; });
  frame.ghosts[0].state = frame.grants[0].bodies[1].state = SampleState(1);
  frame.ghosts[0].state.still_s = std::nanf("");
  EXPECT_EQ(Error(), "body 4: still_s must be a finite number, got nan");
}

TEST_F(FrameCheckTest, LoadsAreFinite) {
  frame.ghosts[0].load_ns = {0, std::nanf(""), 0};
  EXPECT_NE(Error(), "");
  frame.ghosts[0].load_ns = {};
  frame.ghosts[0].load_nms = {0, 0, 1e30F};
  EXPECT_NE(Error(), "");
  frame.ghosts[0].load_nms = {0, 0, 1};
  EXPECT_EQ(Error(), "");
  for (const float load : {-1.0F, std::nanf(""), std::numeric_limits<float>::infinity()}) {
    frame.ghosts[0].island_load = load;
    EXPECT_EQ(Error(), "body 4: island_load is negative or not finite");
  }
}

TEST_F(FrameCheckTest, PushesComeFromPlayersAloneAndWithinTheirLimits) {
  frame.ghosts[0].force_n = {0, 1, 0};
  EXPECT_EQ(Error(), "body 4 is pushed and is no player's");
  frame.ghosts.clear();

  Scene scene = catalog->scene();
  scene.player.emplace().max_force_n = 100;
  catalog = std::make_unique<Catalog>(std::make_shared<const Scene>(scene));
  const BodyId player = PlayerBodyId(PlayerNumber(1));
  GhostRecord ghost{player, Epoch(1), SampleState(1), {0, 100, 0}, {0, 50, 0}, {}, {}};
  frame.ghosts = {ghost};
  EXPECT_EQ(Error(), "");
  frame.ghosts[0].force_n.y = 101;
  EXPECT_EQ(Error(), absl::StrCat("body ", player.value(), ": force_n is more than a player's"));
  frame.ghosts[0].force_n.y = std::nanf("");
  EXPECT_EQ(Error(), absl::StrCat("body ", player.value(), ": force_n.y must be a finite number, got nan"));
  frame.ghosts = {ghost};
  frame.ghosts[0].torque_nm.z = 1e30F;
  EXPECT_EQ(Error(), absl::StrCat("body ", player.value(), ": torque_nm.z must be -1e+15 to 1e+15, got 1e+30"));

  frame.ghosts.clear();
  Grant grant;
  grant.bodies = {{player, Epoch(2), SampleState(1)}};
  grant.control.queue = {
      {.number = 1, .body = player, .force_n = {1e30F, 0, 0}}};  // limits are applied when its tick comes
  frame.grants = {grant};
  EXPECT_EQ(Error(), "");
  frame.grants[0].control.queue[0].torque_nm.x = std::nanf("");
  EXPECT_EQ(Error(), absl::StrCat("body ", player.value(), ": an input's torque_nm is not finite"));
  frame.grants[0].control.queue.clear();
  frame.grants[0].control.next.force_n = {0, 0, 1e30F};
  EXPECT_EQ(Error(), absl::StrCat("body ", player.value(), ": force_n.z must be -1e+15 to 1e+15, got 1e+30"));
}

TEST_F(FrameCheckTest, RefusesGrantsThatAreNotOneAssembly) {
  frame.grants[0].bodies[1].id = BodyId(5);
  EXPECT_EQ(Error(), "body 5 is not of the assembly");
  frame.grants[0].bodies.clear();
  EXPECT_EQ(Error(), "a grant without bodies");
}

TEST_F(FrameCheckTest, RefusesABodyGrantedTwiceOrAlsoShown) {
  frame.grants.push_back(frame.grants[0]);
  EXPECT_EQ(Error(), "body 2 is granted twice");
  frame.grants.pop_back();
  frame.ghosts[0].id = BodyId(3);
  EXPECT_EQ(Error(), "body 3 is granted and a ghost");
}

TEST_F(FrameCheckTest, RefusesImpulsesThatAreNotFiniteOrNotInOrder) {
  frame.impulses[0].angular_on_own.z = std::nanf("");
  EXPECT_EQ(Error(), "body 4: angular impulse is not finite or beyond limits");
  frame.impulses[0].angular_on_own.z = 0;
  frame.impulses[0].impulse_on_own.x = 1e30F;
  EXPECT_EQ(Error(), "body 4: impulse is not finite or beyond limits");
  frame.impulses[0].impulse_on_own.x = 0;
  frame.impulses[0].angular_on_other.x = 1e30F;
  EXPECT_EQ(Error(), "body 5: angular impulse is not finite or beyond limits");
  frame.impulses[0].angular_on_other.x = 0;
  frame.impulses.push_back(frame.impulses[0]);
  EXPECT_EQ(Error(), "body 4: impulses do not ascend");
  frame.impulses.pop_back();
  frame.late_corrections = {{BodyId(4), {0, 0, -1e30F}, {}}};
  EXPECT_EQ(Error(), "body 4: impulse is not finite or beyond limits");
}

}  // namespace
}  // namespace tessera::region
