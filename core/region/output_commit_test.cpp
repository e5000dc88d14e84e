#include "core/region/output_commit.h"

#include <gtest/gtest.h>

namespace tessera::region {
namespace {

constexpr BodyId kCounted{7};
const BodyId kAssembly[] = {kCounted, BodyId(8)};

KeptRecord RecordWith(std::uint8_t value) {
  return {kCounted, 0, std::make_shared<const std::vector<std::uint8_t>>(1, value), {}};
}

class OutputCommitTest : public ::testing::Test {
 protected:
  // Clients are told this of a body with this record.
  int Told(const KeptRecord& now) const {
    const auto& bytes = output.PropertiesOf(now);
    return bytes == nullptr || bytes->empty() ? 0 : bytes->front();
  }
  OutputCommit output;
};

TEST_F(OutputCommitTest, ClientsAreToldWhatTheStandbyHas) {
  const KeptRecord one = RecordWith(1), two = RecordWith(2);
  output.Changed(nullptr, one, Tick(5));
  output.Changed(&one, two, Tick(6));
  EXPECT_EQ(Told(two), 0);
  output.Release(Tick(4), Tick(6));
  EXPECT_EQ(Told(two), 0);
  output.Release(Tick(5), Tick(6));
  EXPECT_EQ(Told(two), 1);
  output.Release(Tick(9), Tick(9));
  EXPECT_EQ(Told(two), 2);
  EXPECT_TRUE(output.empty());
}

TEST_F(OutputCommitTest, WithoutAStandbyNothingWaits) {
  const KeptRecord one = RecordWith(1);
  output.Changed(nullptr, one, Tick(5));
  output.Spawned(kCounted, Tick(5));
  EXPECT_TRUE(output.IsHidden(kCounted));
  output.Release(std::nullopt, Tick(6));
  EXPECT_EQ(Told(one), 1);
  EXPECT_FALSE(output.IsHidden(kCounted));
}

TEST_F(OutputCommitTest, ABodyIsHiddenUntilTheStandbyHasIt) {
  output.Spawned(kCounted, Tick(5));
  output.Release(Tick(4), Tick(6));
  EXPECT_TRUE(output.IsHidden(kCounted));
  EXPECT_FALSE(output.IsHidden(BodyId(8)));
  output.Release(Tick(5), Tick(6));
  EXPECT_FALSE(output.IsHidden(kCounted));
}

TEST_F(OutputCommitTest, WhatWasChangedTogetherIsHandedOverWhenTheStandbyHasIt) {
  output.Changed(nullptr, RecordWith(1), Tick(5));
  EXPECT_FALSE(output.MustWait(kAssembly, Tick(5))) << "it takes its own change along";
  output.Bound(kCounted, Tick(5));
  EXPECT_TRUE(output.MustWait(kAssembly, Tick(5)));
  output.Release(Tick(5), Tick(6));
  EXPECT_FALSE(output.MustWait(kAssembly, Tick(6)));
}

TEST_F(OutputCommitTest, AHandoverDoesNotWaitForEver) {
  output.Bound(kCounted, Tick(5));
  for (std::uint64_t tick = 10; tick < 10 + OutputCommit::kMaxHandoverWait; ++tick) {
    output.Release(Tick(4), Tick(tick));
    EXPECT_TRUE(output.MustWait(kAssembly, Tick(tick)));
  }
  EXPECT_FALSE(output.MustWait(kAssembly, Tick(10 + OutputCommit::kMaxHandoverWait)));
}

TEST_F(OutputCommitTest, ABodyThatWentBackBeginsToWaitAnew) {
  output.Bound(kCounted, Tick(5));
  EXPECT_TRUE(output.MustWait(kAssembly, Tick(5)));
  output.Release(Tick(4), Tick(20));  // it has not been asked for since
  EXPECT_TRUE(output.MustWait(kAssembly, Tick(20)));
  output.Release(Tick(4), Tick(21));
  EXPECT_TRUE(output.MustWait(kAssembly, Tick(5 + OutputCommit::kMaxHandoverWait)));
}

TEST_F(OutputCommitTest, APushIsMotionAndWaitsForNobody) {
  KeptRecord pushed = RecordWith(1);
  const KeptRecord before = pushed;
  pushed.game.push_ns = {1, 0, 0};
  output.Changed(&before, pushed, Tick(5));
  EXPECT_TRUE(output.empty());
  pushed.game.expires = Tick(9);
  output.Changed(&before, pushed, Tick(5));
  EXPECT_FALSE(output.empty());
}

TEST_F(OutputCommitTest, WhatIsOwnedElsewhereIsForgotten) {
  output.Changed(nullptr, RecordWith(1), Tick(5));
  output.Bound(kCounted, Tick(5));
  output.Left(kCounted);
  EXPECT_TRUE(output.empty());
}

}  // namespace
}  // namespace tessera::region
