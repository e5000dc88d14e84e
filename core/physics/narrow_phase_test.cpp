// Contacts of pairs that touch or will, in the order of ids, and sleepers that wake by them.
#include "core/physics/narrow_phase.h"

#include <gmock/gmock.h>

#include <cmath>

#include "core/physics/broad_phase.h"
#include "core/physics/testing/loose_bodies.h"

namespace tessera::physics {
namespace {

using ::testing::ElementsAre;

BodyDef Floating(std::uint64_t id, Vec3d position) {
  BodyDef def = Dynamic(id, Ball(), position);
  def.gravity_scale = 0;
  return def;
}

// The broad phase is not there: every two bodies are a pair, and each says itself how far it reaches.
class NarrowPhaseTest : public ::testing::Test {
 protected:
  void Run() {
    for (const auto& [id, body] : loose_.bodies.all()) {
      body->predicted = body->awake() ? PredictMotion(*body, kDt) : PredictedMotion();
      const Vec3f center(body->placement().position), reach{reach_m_, reach_m_, reach_m_};
      body->reach = body->fat = {center - reach, center + reach};
    }
    for (const auto& [a_id, a] : loose_.bodies.all()) {
      for (const auto& [b_id, b] : loose_.bodies.all()) {
        if (a_id < b_id && (a->dynamic() || b->dynamic())) loose_.pairs.Begin(*a, *b);
      }
    }
    narrow_.Run(kDt, loose_.pairs, loose_.waking);
    EXPECT_TRUE(narrow_.Validate(loose_.bodies.awake()));
  }
  std::vector<std::pair<std::uint64_t, std::uint64_t>> Contacts() const {
    std::vector<std::pair<std::uint64_t, std::uint64_t>> ids;
    for (const ActiveContact& contact : narrow_.contacts()) {
      ids.emplace_back(contact.pair->low->id().value(), contact.pair->high->id().value());
    }
    return ids;
  }

  LooseBodies loose_;
  NarrowPhase narrow_;
  float reach_m_ = 100;
};

TEST_F(NarrowPhaseTest, FindsHowDeepTwoBallsOverlapAndAlongWhichNormal) {
  loose_.Add(Dynamic(1, Ball(), {}));
  loose_.Add(Dynamic(2, Ball(), {0.6, 0.7, 0}));
  Run();
  ASSERT_EQ(narrow_.contacts().size(), 1U);
  const ActiveContact& contact = narrow_.contacts()[0];
  const double apart = std::hypot(0.6, 0.7);
  EXPECT_TRUE(contact.live && contact.responds);
  EXPECT_NEAR(contact.penetration_m, 1 - apart, 1e-6);
  EXPECT_NEAR(contact.normal.x, 0.6 / apart, 1e-6);
  EXPECT_NEAR(contact.normal.y, 0.7 / apart, 1e-6);
}

TEST_F(NarrowPhaseTest, ContactsAscendByIds) {
  for (const std::uint64_t id : {4, 2, 3, 1}) {
    loose_.Add(Dynamic(id, Ball(), {0.9 * static_cast<double>(id), 0, 0}));
  }
  Run();
  EXPECT_THAT(Contacts(), ElementsAre(std::pair(1, 2), std::pair(2, 3), std::pair(3, 4)));
}

// Surfaces that are 1 cm apart count as touching once they may come within a millimetre.
TEST_F(NarrowPhaseTest, APairIsLiveIfItMayTouchWithinTheStep) {
  std::uint64_t id = 1;
  for (const float speed : {0.5f, 0.6f, -5.0f}) {
    BodyDef approaching = Floating(id, {10.0 * static_cast<double>(id), 0, 0});
    approaching.initial.linear_velocity = {speed, 0, 0};
    loose_.Add(approaching);
    loose_.Add(Floating(id + 1, approaching.initial.position + Vec3d{1.01, 0, 0}));
    id += 2;
  }
  reach_m_ = 2;
  Run();
  ASSERT_EQ(narrow_.contacts().size(), 3U);
  EXPECT_FALSE(narrow_.contacts()[0].live);  // .5 m/s makes 8.3 mm a step
  EXPECT_TRUE(narrow_.contacts()[1].live);   // .6 m/s makes 10 mm
  EXPECT_FALSE(narrow_.contacts()[2].live);
}

// A ball that flies at a wall touches where it will meet it, as far ahead as the way to there is long.
TEST_F(NarrowPhaseTest, AFastBodyTouchesWhereItWillMeet) {
  loose_.Add(Static(1, Box(0.5, 5, 5), {2, 0, 0}));
  BodyDef ball = Floating(2, {0, 0, 0});
  ball.initial.linear_velocity = {90, 0, 0};
  loose_.Add(ball);
  Run();
  ASSERT_EQ(narrow_.contacts().size(), 1U);
  const ActiveContact& contact = narrow_.contacts()[0];
  EXPECT_TRUE(contact.pair->swept && contact.live);
  EXPECT_NEAR(contact.pair->separation_m, 1.0, 1e-4);
  EXPECT_NEAR(contact.impact_m_s, 90, 1e-3);
}

TEST_F(NarrowPhaseTest, AFastBodyThatPassesByTouchesNothing) {
  loose_.Add(Static(1, Box(0.5, 0.5, 0.5), {2, 0, 0}));
  BodyDef ball = Floating(2, {0, 1.1, 0});
  ball.initial.linear_velocity = {150, 0, 0};
  loose_.Add(ball);
  Run();
  EXPECT_TRUE(narrow_.contacts().empty());
}

TEST_F(NarrowPhaseTest, SleepersWakeFromOneToTheNext) {
  loose_.Add(Floating(1, {0, 0, 0}));
  for (std::uint64_t id = 2; id <= 4; ++id) {
    BodyDef sleeper = Floating(id, {0.99 * static_cast<double>(id - 1), 0, 0});
    sleeper.initial.asleep = true;
    loose_.Add(sleeper);
  }
  BodyDef far = Floating(5, {8, 0, 0});
  far.initial.asleep = true;
  loose_.Add(far);
  Run();
  EXPECT_EQ(loose_.bodies.awake().size(), 4U);
  EXPECT_FALSE(loose_.bodies.At(BodyId(5)).awake());
  EXPECT_THAT(Contacts(), ElementsAre(std::pair(1, 2), std::pair(2, 3), std::pair(3, 4)));
}

TEST_F(NarrowPhaseTest, ATriggerHasContactsButNeitherPushesNorWakes) {
  BodyDef trigger = Static(1, Cube());
  trigger.trigger = true;
  loose_.Add(trigger);
  loose_.Add(Floating(2, {0.2, 0, 0}));
  BodyDef sleeper = Floating(3, {0, 0.2, 0});
  sleeper.trigger = true;
  sleeper.initial.asleep = true;
  loose_.Add(sleeper);
  Run();
  ASSERT_EQ(narrow_.contacts().size(), 2U);
  for (const ActiveContact& contact : narrow_.contacts()) EXPECT_FALSE(contact.responds);
  EXPECT_FALSE(loose_.bodies.At(BodyId(3)).awake());
}

TEST_F(NarrowPhaseTest, BodiesOfOneExclusionGroupComeApart) {
  RigidBody &a = loose_.Add(Floating(1, {})), &b = loose_.Add(Floating(2, {0.9, 0, 0}));
  Run();
  ASSERT_EQ(narrow_.contacts().size(), 1U);
  loose_.pairs.Find(a, b)->touching = true;
  a.exclusion_group = ExclusionGroup{1};
  Run();
  EXPECT_EQ(narrow_.contacts().size(), 1U);
  b.exclusion_group = ExclusionGroup{1};
  Run();
  EXPECT_TRUE(narrow_.contacts().empty());
  EXPECT_THAT(narrow_.parting(), ElementsAre(loose_.pairs.Find(a, b)));
}

TEST_F(NarrowPhaseTest, APairEndsOnceItsBoundsAreApart) {
  RigidBody &a = loose_.Add(Floating(1, {})), &b = loose_.Add(Floating(2, {0.9, 0, 0}));
  Run();
  Pair* pair = loose_.pairs.Find(a, b);
  ASSERT_NE(pair, nullptr);
  pair->touching = true;
  reach_m_ = 0.4f;
  Run();
  EXPECT_EQ(loose_.pairs.Find(a, b), nullptr);
  EXPECT_TRUE(loose_.pairs.has_ended());
  EXPECT_TRUE(narrow_.contacts().empty() && narrow_.parting().empty());
}

}  // namespace
}  // namespace tessera::physics
