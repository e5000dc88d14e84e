#include "control_plane/branches.h"

#include <gmock/gmock.h>

#include <vector>

namespace tessera::control {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

class BranchesTest : public ::testing::Test {
 protected:
  void Make(std::uint64_t tick) {
    v1::Checkpoint& checkpoint = *record_.add_checkpoints();
    checkpoint.set_tick(tick);
    *checkpoint.mutable_branch() = record_.branch();
  }
  // Goes back to the checkpoint at this place of the list.
  void Restore(int place) {
    records::Manifest manifest;
    manifest.set_tick(record_.checkpoints(place).tick());
    *manifest.mutable_branch() = record_.checkpoints(place).branch();
    BeginBranch(manifest, record_);
  }
  std::vector<std::uint64_t> TakenBack() const {
    std::vector<std::uint64_t> ticks;
    for (const v1::Checkpoint& checkpoint : record_.checkpoints()) {
      if (checkpoint.taken_back()) ticks.push_back(checkpoint.tick());
    }
    return ticks;
  }

  records::Instance record_;
};

TEST_F(BranchesTest, ARestoreTakesBackWhatCameAfter) {
  for (const std::uint64_t tick : {90, 200, 484}) Make(tick);
  EXPECT_THAT(TakenBack(), IsEmpty());
  Restore(0);
  EXPECT_THAT(TakenBack(), ElementsAre(200, 484));
  EXPECT_EQ(NewestKept(record_.checkpoints())->tick(), 90U);
  EXPECT_EQ(KeptOf(record_.checkpoints(), 484), nullptr);
  Make(150);
  EXPECT_EQ(NewestKept(record_.checkpoints())->tick(), 150U);
  EXPECT_EQ(FirstToGo(record_.checkpoints()), 1) << "what was taken back goes first";
  Restore(3);
  EXPECT_THAT(TakenBack(), ElementsAre(200, 484)) << "150 is after 90";
}

TEST_F(BranchesTest, WhoGoesToATimeThatWasTakenBackHasItsPast) {
  for (const std::uint64_t tick : {90, 200, 484}) Make(tick);
  Restore(0);
  Make(150);
  Restore(2);  // 484 of the first branch
  EXPECT_THAT(TakenBack(), ElementsAre(150));
  Make(500);
  Restore(3);  // 150 of the second, which began after 90
  EXPECT_THAT(TakenBack(), ElementsAre(200, 484, 500));
  EXPECT_EQ(record_.branch().number(), 3U);
  EXPECT_EQ(record_.branch().parent(), 1U);
  EXPECT_EQ(record_.branch().parent_tick(), 150U);
}

TEST_F(BranchesTest, APastOfWhichNothingIsLeftEndsThere) {
  Make(90);
  Restore(0);
  Make(200);
  Restore(1);
  Make(300);
  record_.mutable_checkpoints()->DeleteSubrange(1, 1);  // the one of the branch between them
  Restore(1);
  EXPECT_THAT(TakenBack(), ElementsAre(90)) << "no branch is known by which it led here";
  EXPECT_EQ(NewestKept(record_.checkpoints())->tick(), 300U);
}

TEST_F(BranchesTest, AnImportedWorldHasTheBranchOfItsFile) {
  records::Manifest manifest;
  manifest.set_tick(70);
  manifest.mutable_branch()->set_number(4);
  BeginBranch(manifest, record_);
  EXPECT_EQ(record_.branch().parent(), 4U);
  EXPECT_EQ(NewestKept(record_.checkpoints()), nullptr);
  EXPECT_EQ(KeptOf(record_.checkpoints(), 70), nullptr);
}

}  // namespace
}  // namespace tessera::control
