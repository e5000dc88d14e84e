#include "core/region/outgoing.h"

#include <gtest/gtest.h>

#include "core/region/testing/small_world.h"

namespace tessera::region {
namespace {

const std::vector<RegionId> kBoth = {kTwo, kThree};

LateCorrection Late(std::uint64_t id) { return {BodyId(id), {}, {}}; }

std::vector<std::uint64_t> Taken(OutgoingMessages& messages, RegionId to) {
  BorderFrame frame;
  messages.MoveTo(to, frame);
  std::vector<std::uint64_t> ids;
  for (const LateCorrection& late : frame.late_corrections) ids.push_back(late.id.value());
  return ids;
}

TEST(OutgoingMessagesTest, LeaveOnceAndInOrder) {
  OutgoingMessages messages(kBoth);
  messages.Add(kTwo, Late(5));
  messages.Add(kThree, Late(1));
  messages.Add(kTwo, Late(4));
  EXPECT_EQ(Taken(messages, kTwo), (std::vector<std::uint64_t>{5, 4}));
  EXPECT_TRUE(Taken(messages, kTwo).empty());
  EXPECT_EQ(Taken(messages, kThree), std::vector<std::uint64_t>{1});
}

TEST(OutgoingMessagesTest, OthersThanTheNeighboursAreNoticed) {
  OutgoingMessages messages(kBoth);
  messages.Validate(kBoth);
  EXPECT_DEBUG_DEATH(messages.Validate(std::vector{kTwo, kFour}), "");
  EXPECT_DEBUG_DEATH(messages.Validate(std::vector{kTwo}), "");
}

TEST(OutgoingMessagesTest, AreDroppedForWhoeverIsNoNeighbour) {
  OutgoingMessages messages(kBoth);
  messages.Add(kFour, Late(1));
  messages.Add(kTwo, Late(2));
  messages.Add(kThree, Late(3));
  const std::vector<RegionId> next = {kThree, kFour};
  messages.SetNeighbors(next, false);
  EXPECT_TRUE(Taken(messages, kFour).empty());
  EXPECT_EQ(Taken(messages, kThree), std::vector<std::uint64_t>{3});
  messages.Add(kThree, Late(4));
  messages.SetNeighbors(next, true);
  EXPECT_TRUE(Taken(messages, kThree).empty());
}

}  // namespace
}  // namespace tessera::region
