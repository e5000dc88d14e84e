// The tree finds what comparing all with all finds, through any changes.
#include "core/physics/bounds_tree.h"

#include <gmock/gmock.h>

#include <map>
#include <random>
#include <vector>

#include "core/physics/testing/loose_bodies.h"

namespace tessera::physics {
namespace {

Bounds BoundsAbout(Vec3f middle, float half) {
  const Vec3f h{half, half, half};
  return {middle - h, middle + h};
}

class BoundsTreeTest : public ::testing::Test {
 protected:
  BoundsTree::Leaf Insert(const Bounds& bounds) {
    const BoundsTree::Leaf leaf = tree_.Insert(bounds, body_);
    bounds_[leaf] = bounds;
    return leaf;
  }
  void Remove(BoundsTree::Leaf leaf) {
    tree_.Remove(leaf);
    bounds_.erase(leaf);
  }
  void Update(BoundsTree::Leaf leaf, const Bounds& bounds) {
    tree_.Update(leaf, bounds);
    bounds_[leaf] = bounds;
  }
  std::vector<BoundsTree::Leaf> Found(const Bounds& bounds) const {
    std::vector<BoundsTree::Leaf> found;
    tree_.Overlapping(bounds, [&](BoundsTree::Leaf leaf, const Bounds& of_leaf) {
      EXPECT_EQ(of_leaf.min, bounds_.at(leaf).min);
      EXPECT_EQ(of_leaf.max, bounds_.at(leaf).max);
      found.push_back(leaf);
    });
    return found;
  }
  void ExpectFindsAll(const Bounds& bounds) const {
    std::vector<BoundsTree::Leaf> expected;
    for (const auto& [leaf, of_leaf] : bounds_) {
      if (of_leaf.Overlaps(bounds)) expected.push_back(leaf);
    }
    EXPECT_THAT(Found(bounds), ::testing::UnorderedElementsAreArray(expected));
  }

  LooseBodies loose_;
  RigidBody& body_ = loose_.Add(Dynamic(1, Ball(), {}));
  BoundsTree tree_;
  std::map<BoundsTree::Leaf, Bounds> bounds_;
};

TEST_F(BoundsTreeTest, AnEmptyTreeFindsNothing) {
  EXPECT_THAT(Found(BoundsAbout({}, 1e9f)), ::testing::IsEmpty());
  EXPECT_TRUE(tree_.Validate());
  Remove(Insert(BoundsAbout({}, 1)));
  EXPECT_THAT(Found(BoundsAbout({}, 1e9f)), ::testing::IsEmpty());
  EXPECT_TRUE(tree_.Validate());
}

TEST_F(BoundsTreeTest, BoundsThatShareAFaceOverlap) {
  const BoundsTree::Leaf leaf = Insert(BoundsAbout({}, 1));
  EXPECT_THAT(Found(BoundsAbout({2, 0, 0}, 1)), ::testing::ElementsAre(leaf));
  EXPECT_THAT(Found(BoundsAbout({2.001f, 0, 0}, 1)), ::testing::IsEmpty());
  for (const Vec3f off : {Vec3f{0, 2.001f, 0}, Vec3f{0, 0, 2.001f}, Vec3f{-2.001f, 0, 0}, Vec3f{0, -2.001f, 0}}) {
    EXPECT_THAT(Found(BoundsAbout(off, 1)), ::testing::IsEmpty());
  }
  EXPECT_EQ(&tree_.BodyOf(leaf), &body_);
}

TEST_F(BoundsTreeTest, FindsWhatIsThereThroughAllChanges) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> place(-20, 20), size(0.1f, 3);
  const auto any = [&] { return BoundsAbout({place(random), place(random), place(random)}, size(random)); };
  Insert({{-1e9f, -1e9f, -1e9f}, {1e9f, 1e9f, 1e9f}});  // a plane
  for (int round = 0; round < 1500; ++round) {
    const auto at = std::next(bounds_.begin(), static_cast<long>(random() % bounds_.size()));
    switch (random() % 4) {
      case 0:
        if (bounds_.size() > 1) Remove(at->first);
        break;
      case 1:
        Update(at->first, any());
        break;
      default:
        Insert(any());
    }
    ASSERT_EQ(tree_.size(), bounds_.size());
    if (round % 20 == 0) {
      ASSERT_TRUE(tree_.Validate()) << round;
      ExpectFindsAll(any());
    }
  }
  for (int i = 0; i < 100; ++i) ExpectFindsAll(any());
  while (!bounds_.empty()) {
    Remove(bounds_.begin()->first);
    ASSERT_TRUE(tree_.Validate()) << bounds_.size();
  }
}

TEST_F(BoundsTreeTest, BodiesInARowOrInOnePlaceAreFoundToo) {
  for (int i = 0; i < 3000; ++i) Insert(BoundsAbout({static_cast<float>(i), 0, 0}, 0.4f));
  for (int i = 0; i < 300; ++i) Insert(BoundsAbout({0, 50, 0}, 1));
  EXPECT_TRUE(tree_.Validate());
  EXPECT_EQ(Found(BoundsAbout({1500, 0, 0}, 0.1f)).size(), 1u);
  EXPECT_EQ(Found(BoundsAbout({0, 51, 0}, 0.5f)).size(), 300u);
}

TEST_F(BoundsTreeTest, AWalkGoesWhereBoundsSayAndEndsWhenAVisitDoes) {
  for (int i = 0; i < 500; ++i) Insert(BoundsAbout({static_cast<float>(3 * i), 0, 0}, 1));
  const Bounds wanted = BoundsAbout({600, 0, 0}, 10);
  std::vector<BoundsTree::Leaf> found;
  int looks = 0;
  const auto crosses = [&](const Bounds& bounds) { return ++looks, bounds.Overlaps(wanted); };
  EXPECT_TRUE(tree_.Walk(crosses, [&](BoundsTree::Leaf leaf) { return found.push_back(leaf), true; }));
  EXPECT_EQ(found.size(), 7u);
  EXPECT_LT(looks, 100);
  int visits = 0;
  EXPECT_FALSE(tree_.Walk(crosses, [&](BoundsTree::Leaf) { return ++visits < 3; }));
  EXPECT_EQ(visits, 3);
}

}  // namespace
}  // namespace tessera::physics
