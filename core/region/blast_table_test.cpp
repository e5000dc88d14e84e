#include "core/region/blast_table.h"

#include <gmock/gmock.h>

#include "core/region/testing/small_world.h"
#include "game_sdk/api/api.h"

namespace tessera::region {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

game::Blast BlastAt(Vec3d at, std::uint64_t id, std::uint64_t due) {
  game::Blast blast;
  blast.id = id;
  blast.due = Tick(due);
  blast.ends = Tick(due + 600);
  blast.at = at;
  blast.radius_m = 5;
  blast.impulse_ns = 1;
  return blast;
}

class BlastTableTest : public ::testing::Test {
 protected:
  BlastTableTest() {
    world.Own(1);
    world.Own(2);
  }
  // The bodies that a step to this tick pushes.
  std::vector<std::uint64_t> Act(std::uint64_t tick) {
    std::vector<std::uint64_t> pushed;
    for (const game::GameEvent& event : table.Act(Tick(tick), world.bodies, records)) {
      EXPECT_EQ(event.callback, game::kOnBodyBlast);
      pushed.push_back(event.self.value());
    }
    return pushed;
  }
  std::vector<std::uint64_t> MarksOf(std::uint64_t id) const {
    std::vector<std::uint64_t> marks;
    for (const game::BlastMark& mark : records.Of(BodyId(id)).game.blasts) marks.push_back(mark.id);
    return marks;
  }
  void GiveMark(std::uint64_t id, std::uint64_t blast, std::uint64_t ends) {
    CarriedRecord record = records.Of(BodyId(id));
    record.game.blasts.push_back({blast, Tick(ends)});
    records.Adopt(BodyId(id), record);
    table.Came(BodyId(id));
  }

  SmallWorld world{Balls({{-2, 0, 0}, {-4, 0, 0}, {-6, 0, 0}})};
  RecordTable records;
  BlastTable table{*world.scene};
};

TEST_F(BlastTableTest, ActsOnceAtItsTickOrAfterIt) {
  table.Make(BlastAt({-3, 0, 0}, 7, 5), Tick(1));
  EXPECT_TRUE(table.waits());
  EXPECT_THAT(Act(4), IsEmpty());
  EXPECT_THAT(Act(6), ElementsAre(1U, 2U));
  EXPECT_THAT(Act(7), IsEmpty());
  EXPECT_GT(records.Of(BodyId(1)).game.push_ns.x, 0);
  EXPECT_LT(records.Of(BodyId(2)).game.push_ns.x, 0);
  EXPECT_THAT(table.all(), SizeIs(1)) << "for bodies that come";
  EXPECT_THAT(Act(606), IsEmpty());
  EXPECT_THAT(table.all(), IsEmpty());
}

TEST_F(BlastTableTest, WhoComesIsSettledForWhatItWasNotYet) {
  table.Make(BlastAt({-3, 0, 0}, 7, 5), Tick(1));
  table.Make(BlastAt({-3, 0, 0}, 8, 5), Tick(1));
  Act(5);
  world.Own(3);
  GiveMark(3, 7, 605);
  EXPECT_THAT(Act(6), ElementsAre(3U)) << "by the other one";
  EXPECT_THAT(MarksOf(3), IsEmpty()) << "the region's own knowledge is enough";
  EXPECT_THAT(Act(7), IsEmpty());
}

TEST_F(BlastTableTest, AMarkOutlivesThatItsBlastIsUnknown) {
  GiveMark(1, 7, 605);
  EXPECT_THAT(Act(6), IsEmpty());
  EXPECT_THAT(MarksOf(1), ElementsAre(7U));
  table.Adopt(std::vector{KeptBlast{BlastAt({-3, 0, 0}, 7, 5), true}});
  EXPECT_THAT(Act(8), ElementsAre(2U)) << "what another region has done to its bodies says nothing of these";
  Act(9);
  EXPECT_THAT(MarksOf(1), IsEmpty());
}

// One with a mark of a blast that is not known here is looked at in each tick.
TEST_F(BlastTableTest, OthersActOnceOnWhoHasAMarkOfAnUnknownOne) {
  table.Make(BlastAt({-3, 0, 0}, 8, 3), Tick(1));
  table.Make(BlastAt({-3, 0, 0}, 9, 6), Tick(1));
  EXPECT_THAT(Act(3), ElementsAre(1U, 2U));
  world.Own(3);
  GiveMark(3, 7, 605);
  EXPECT_THAT(Act(4), ElementsAre(3U)) << "by 8";
  EXPECT_THAT(Act(5), IsEmpty());
  EXPECT_THAT(Act(6), ElementsAre(1U, 2U, 3U)) << "by 9";
  EXPECT_THAT(Act(7), IsEmpty());
  EXPECT_THAT(MarksOf(3), ElementsAre(7U, 8U, 9U));
}

TEST_F(BlastTableTest, AMarkEndsWithItsBlast) {
  GiveMark(1, 7, 20);
  Act(20);
  EXPECT_THAT(MarksOf(1), ElementsAre(7U));
  Act(21);
  EXPECT_THAT(MarksOf(1), IsEmpty());
}

TEST_F(BlastTableTest, ARecordThatLeavesIsMarked) {
  table.Make(BlastAt({-3, 0, 0}, 7, 5), Tick(1));
  table.Make(BlastAt({-3, 0, 0}, 9, 50), Tick(1));
  Act(5);
  game::GameRecord record;
  table.Mark(record);
  EXPECT_THAT(record.blasts, ElementsAre(game::BlastMark{7, Tick(605)})) << "none that is to come";
}

TEST_F(BlastTableTest, OtherLayersAndKinematicBodiesStay) {
  game::Blast blast = BlastAt({-3, 0, 0}, 7, 5);
  blast.layers = 2;
  table.Make(blast, Tick(1));
  EXPECT_THAT(Act(5), IsEmpty());
}

TEST_F(BlastTableTest, OneThatHasEndedIsNotTakenIn) {
  MessagePacket packet;
  packet.kind = PacketKind::kBlast;
  packet.number = 7;
  ByteWriter out;
  Write(out, BlastAt({-3, 0, 0}, 7, 5));
  packet.properties = out.Take();
  table.Receive({&packet, 1}, Tick(606));
  EXPECT_THAT(table.all(), IsEmpty());
  table.Receive({&packet, 1}, Tick(600));
  table.Receive({&packet, 1}, Tick(600));
  EXPECT_THAT(table.all(), SizeIs(1));
}

}  // namespace
}  // namespace tessera::region
