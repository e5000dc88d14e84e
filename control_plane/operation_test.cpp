#include "control_plane/operation.h"

#include <gmock/gmock.h>

namespace tessera::control {
namespace {

using ::testing::ElementsAre;

// A world of two regions at rest, as operation 1-1 made it.
records::Instance OperatedWorld() {
  records::Instance record;
  record.set_id("inst-7");
  record.set_state(v1::INSTANCE_STATE_RUNNING);
  record.set_wanted_regions(2);
  record.set_operation("1-1");
  for (const std::uint32_t region : {1U, 2U}) {
    record.mutable_map()->add_regions()->set_id(region);
    record.add_placements()->set_region(region);
    record.mutable_placements(static_cast<int>(region) - 1)->set_incarnation(region);
  }
  record.add_events()->set_text("begun");
  record.mutable_events(0)->set_operation("1-1");
  return record;
}

TEST(OperationTest, AWishBeginsOneAndTheMapThatCarriesItOutBelongsToIt) {
  const records::Instance before = OperatedWorld();
  records::Instance asked = before;
  asked.set_wanted_regions(3);
  asked.add_events()->set_text("scaling from 2 to 3");
  const NamedRecord named = NameOperation(before, asked, "1-2");
  EXPECT_TRUE(named.begins);
  EXPECT_EQ(named.record.operation(), "1-2");
  EXPECT_EQ(named.record.events(0).operation(), "1-1");
  EXPECT_EQ(named.record.events(1).operation(), "1-2");
  EXPECT_THAT(named.lines, ElementsAre("event id=inst-7 op=1-2: scaling from 2 to 3"));

  records::Instance planned = named.record;
  planned.mutable_planned()->mutable_map()->set_version(2);
  const NamedRecord carried = NameOperation(named.record, planned, "1-3");
  EXPECT_FALSE(carried.begins);
  EXPECT_EQ(carried.record.operation(), "1-2");
  EXPECT_TRUE(carried.lines.empty());
}

TEST(OperationTest, AChangeThatNobodyAskedForIsOneOfItsOwn) {
  const records::Instance before = OperatedWorld();
  records::Instance balanced = before;
  balanced.mutable_planned()->mutable_map()->set_version(2);
  EXPECT_TRUE(BeginsOperation(before, balanced));
  EXPECT_FALSE(BeginsOperation(balanced, balanced)) << "its steps are of it";
}

TEST(OperationTest, AFailoverAndTheWorkerThatReplacesTheDeadAreOne) {
  const records::Instance before = OperatedWorld();
  records::Instance failing = before;
  failing.mutable_failover()->add_dead()->set_region(2);
  failing.mutable_map()->mutable_regions()->RemoveLast();
  EXPECT_TRUE(BeginsOperation(before, failing));
  records::Instance again = failing;
  again.mutable_failover()->add_dead()->set_region(1);
  EXPECT_FALSE(BeginsOperation(failing, again)) << "another death in it";
  records::Instance over = failing;
  over.clear_failover();
  EXPECT_FALSE(BeginsOperation(failing, over));
  records::Instance replaces = over;
  replaces.mutable_planned()->mutable_map()->set_version(4);
  EXPECT_FALSE(BeginsOperation(over, replaces)) << "a region is owed";
}

TEST(OperationTest, RestoresAndEndsBeginOne) {
  const records::Instance before = OperatedWorld();
  records::Instance restored = before;
  restored.mutable_restored()->set_last_incarnation(9);
  EXPECT_TRUE(BeginsOperation(before, restored));
  records::Instance stopping = before;
  stopping.set_state(v1::INSTANCE_STATE_STOPPING);
  EXPECT_TRUE(BeginsOperation(before, stopping));
  records::Instance ended = stopping;
  ended.set_state(v1::INSTANCE_STATE_ENDED);
  EXPECT_FALSE(BeginsOperation(stopping, ended));
  EXPECT_FALSE(BeginsOperation(before, before));
}

TEST(OperationTest, EventsAreNamedThoughTheOldestWentForThem) {
  const records::Instance before = OperatedWorld();
  records::Instance next = before;
  next.mutable_events()->Clear();
  next.add_events()->set_text("one");
  next.add_events()->set_text("two");
  const NamedRecord named = NameOperation(before, next, "1-2");
  EXPECT_THAT(named.lines, ElementsAre("event id=inst-7 op=1-1: one", "event id=inst-7 op=1-1: two"));
}

}  // namespace
}  // namespace tessera::control
