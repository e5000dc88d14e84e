// Pairs begin and end to touch once, and contacts report the impulses of their points.
#include "core/physics/report.h"

#include <gmock/gmock.h>

#include "core/physics/testing/loose_bodies.h"

namespace tessera::physics {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

PairEvent Event(std::uint64_t a, std::uint64_t b, bool begin, bool trigger = false) {
  return {BodyId(a), BodyId(b), trigger, begin};
}

class ReportTest : public ::testing::Test {
 protected:
  // Pairs with manifolds go to the contacts of the outcome, others that touch to the parting ones.
  std::span<const PairEvent> Run(std::initializer_list<Pair*> pairs) {
    contacts_.clear();
    parting_.clear();
    for (Pair* pair : pairs) {
      if (pair->manifolds.empty()) {
        if (pair->touching) parting_.push_back(pair);
        continue;
      }
      ActiveContact contact = ContactBetween(0, 1);
      contact.pair = pair;
      contact.low_tag = pair->low->tag;
      contact.high_tag = pair->high->tag;
      contact.substeps = 4;
      contact.responds = pair->responds();
      contacts_.push_back(contact);
    }
    report_.Run(Outcome(), loose_.pairs);
    EXPECT_TRUE(report_.Validate());
    return report_.events();
  }
  StepOutcome Outcome() const { return {contacts_, parting_, crossed_, stop_impulses_}; }

  LooseBodies loose_;
  RigidBody& a_ = loose_.Add(Dynamic(1, Ball(), {}));
  RigidBody& b_ = loose_.Add(Dynamic(2, Ball(), {1, 0, 0}));
  RigidBody& c_ = loose_.Add(Dynamic(3, Ball(), {2, 0, 0}));
  std::vector<ActiveContact> contacts_;
  std::vector<Pair*> parting_, crossed_;
  std::vector<PairImpulse> stop_impulses_;
  Report report_;
};

TEST_F(ReportTest, ATouchBeginsAndEndsOnce) {
  Pair& pair = loose_.AddContact(a_, b_, {1, 0, 0}, 0.001f);
  EXPECT_THAT(Run({&pair}), IsEmpty()) << "1 mm apart";
  pair.separation_m = 0;
  EXPECT_THAT(Run({&pair}), ElementsAre(Event(1, 2, true)));
  EXPECT_THAT(Run({&pair}), IsEmpty());
  pair.separation_m = 0.004f;
  EXPECT_THAT(Run({&pair}), IsEmpty()) << "it touches until it is 5 mm apart";
  pair.separation_m = 0.006f;
  EXPECT_THAT(Run({&pair}), ElementsAre(Event(1, 2, false)));
  EXPECT_THAT(Run({&pair}), IsEmpty());
}

TEST_F(ReportTest, AContactThatPushedTouched) {
  Pair& pair = loose_.AddContact(a_, b_, {1, 0, 0}, 0.01f);
  pair.manifolds[0].points[0].total_impulse = 3;
  EXPECT_THAT(Run({&pair}), ElementsAre(Event(1, 2, true)));
  EXPECT_EQ(pair.impulse_ns, 3);
  EXPECT_EQ(pair.load_ns, 0) << "a blow is no load";
  EXPECT_EQ(pair.substeps, 4);
  Run({&pair});
  EXPECT_EQ(pair.load_ns, 3);
}

TEST_F(ReportTest, APairWithoutManifoldsHasParted) {
  Pair& pair = loose_.AddContact(a_, b_, {1, 0, 0});
  Run({&pair});
  pair.manifolds.clear();
  pair.separation_m = 9;
  EXPECT_THAT(Run({&pair}), ElementsAre(Event(1, 2, false)));
  EXPECT_THAT(Run({&pair}), IsEmpty());
}

TEST_F(ReportTest, APairThatEndedWhileItTouchedIsReportedBesidesTheOthersInTheOrderOfIds) {
  Pair &last = loose_.AddContact(b_, c_, {1, 0, 0}), &first = loose_.AddContact(a_, b_, {1, 0, 0});
  Run({&first});
  loose_.pairs.End(first);
  EXPECT_THAT(Run({&last}), ElementsAre(Event(1, 2, false), Event(2, 3, true)));
  EXPECT_THAT(Run({&last}), IsEmpty());
}

TEST_F(ReportTest, ACrossedTriggerBeginsOnceAndEndsInTheNextStep) {
  BodyDef def = Static(4, Cube());
  def.trigger = true;
  RigidBody& trigger = loose_.Add(def);
  loose_.pairs.Begin(a_, trigger);
  Pair* pair = loose_.pairs.Find(a_, trigger);
  pair->separation_m = 2;
  crossed_ = {pair, pair};  // both bodies were swept
  EXPECT_THAT(Run({}), ElementsAre(Event(1, 4, true, true)));
  crossed_.clear();
  EXPECT_THAT(Run({pair}), ElementsAre(Event(1, 4, false, true)));
}

TEST_F(ReportTest, AnIdleStepReportsNothing) {
  Pair& pair = loose_.AddContact(a_, b_, {1, 0, 0});
  Run({&pair});
  report_.RunIdle();
  EXPECT_THAT(report_.events(), IsEmpty());
  EXPECT_THAT(report_.Contacts({}, loose_.bodies), IsEmpty());
}

// --- Contacts

TEST_F(ReportTest, AContactSumsItsPointsAboutEachCentre) {
  Pair& pair = loose_.AddContact(a_, b_, {1, 0, 0}, -0.01f);
  Manifold& manifold = pair.manifolds[0];
  manifold.points[0].r_a = {0.5f, 0.1f, 0};
  manifold.points[0].r_b = {-0.5f, 0.1f, 0};
  manifold.points[0].total_impulse = 4;
  manifold.total_friction = {0, 2, 0};
  manifold.friction_r_a = {0.5f, 0, 0};
  manifold.friction_r_b = {-0.5f, 0, 0};
  Run({&pair});
  const std::span<const Contact> contacts = report_.Contacts(Outcome(), loose_.bodies);
  ASSERT_EQ(contacts.size(), 1U);
  EXPECT_EQ(contacts[0].impulse_on_b, Vec3f(4, 2, 0));
  EXPECT_FLOAT_EQ(contacts[0].angular_impulse_on_a.z, -0.5f * 2 + 0.1f * 4);
  EXPECT_FLOAT_EQ(contacts[0].angular_impulse_on_b.z, -0.5f * 2 - 0.1f * 4);
  EXPECT_EQ(contacts[0].depth_m, 0.01f);
  EXPECT_LT(Length(contacts[0].point - Vec3d{0.5, 0.1, 0}), 1e-7);
}

TEST_F(ReportTest, ImpulsesOfStopsJoinThoseOfTheirPairsAndFillTheirPlaces) {
  Pair& pair = loose_.AddContact(b_, c_, {1, 0, 0});
  pair.manifolds[0].points[0].total_impulse = 4;
  PairImpulse first{.body_a = BodyId(1),
                    .body_b = BodyId(2),
                    .impulse_on_b = {1, 0, 0},
                    .angular_impulse_on_a = {},
                    .angular_impulse_on_b = {}},
      second = first;
  second.body_a = BodyId(2);
  second.body_b = BodyId(3);
  stop_impulses_ = {second, first};
  Run({&pair});
  const std::span<const Contact> contacts = report_.Contacts(Outcome(), loose_.bodies);
  ASSERT_EQ(contacts.size(), 2U);
  EXPECT_EQ(contacts[0].body_a, BodyId(1));
  EXPECT_EQ(contacts[0].impulse_on_b.x, 1);
  EXPECT_EQ(contacts[1].body_a, BodyId(2));
  EXPECT_EQ(contacts[1].impulse_on_b.x, 5);
}

TEST_F(ReportTest, ImpulsesAreAskedForByTheBitsOfTags) {
  a_.tag = 0, b_.tag = 1, c_.tag = 2;
  Pair &ab = loose_.AddContact(a_, b_, {1, 0, 0}), &bc = loose_.AddContact(b_, c_, {1, 0, 0});
  Run({&ab, &bc});
  const auto count = [&](std::vector<std::uint8_t> bits) {
    return report_.ImpulsesOf(bits, Outcome(), loose_.bodies).size();
  };
  EXPECT_EQ(count({1, 2, 1}), 2U);
  EXPECT_EQ(count({1, 2, 0}), 1U);
  EXPECT_EQ(count({1, 1, 1}), 0U);
  EXPECT_EQ(count({3}), 1U) << "what has no bits has none";
}

}  // namespace
}  // namespace tessera::physics
