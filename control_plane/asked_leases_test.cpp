// A lease is given on the strength of a proof that was begun after it was asked for, and of no other.
#include "control_plane/asked_leases.h"

#include <gmock/gmock.h>

#include <cstdint>
#include <utility>
#include <vector>

#include "control_plane/control_settings.h"
#include "control_plane/testing/lease_request.h"

namespace tessera::control {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::Pair;

// Streams and numbers of what is given.
std::vector<std::pair<StreamId, std::uint64_t>> GivenBy(AskedLeases& asked, bool proved = true) {
  std::vector<std::pair<StreamId, std::uint64_t>> given;
  for (const AskedLeases::Asked& one : asked.End(proved)) given.emplace_back(one.stream, one.request.number());
  return given;
}

TEST(AskedLeasesTest, NobodyAsksSoNothingIsProved) {
  AskedLeases asked;
  EXPECT_FALSE(asked.Begin());
}

TEST(AskedLeasesTest, OneProofIsForAllThatAskedBeforeIt) {
  AskedLeases asked;
  asked.Put(7, AskFor(1, 11));
  asked.Put(3, AskFor(2, 22));
  asked.Put(7, AskFor(3, 33));
  ASSERT_TRUE(asked.Begin());
  EXPECT_THAT(GivenBy(asked), ElementsAre(Pair(3, 22), Pair(7, 11), Pair(7, 33)));
  EXPECT_FALSE(asked.Begin()) << "nobody waits any more";
}

TEST(AskedLeasesTest, WhoAsksDuringAProofWaitsForTheNextOne) {
  AskedLeases asked;
  asked.Put(1, AskFor(1, 11));
  ASSERT_TRUE(asked.Begin());
  asked.Put(1, AskFor(2, 22));
  asked.Put(1, AskFor(1, 12));
  EXPECT_FALSE(asked.Begin()) << "one is under way";
  EXPECT_THAT(GivenBy(asked), ElementsAre(Pair(1, 11)));
  ASSERT_TRUE(asked.Begin());
  EXPECT_THAT(GivenBy(asked), ElementsAre(Pair(1, 22), Pair(1, 12)));
}

TEST(AskedLeasesTest, AFailedProofGivesNothingThenOrLater) {
  AskedLeases asked;
  asked.Put(1, AskFor(1, 11));
  ASSERT_TRUE(asked.Begin());
  EXPECT_THAT(GivenBy(asked, false), IsEmpty());
  EXPECT_FALSE(asked.Begin());
  asked.Put(1, AskFor(1, 12));
  ASSERT_TRUE(asked.Begin());
  EXPECT_THAT(GivenBy(asked), ElementsAre(Pair(1, 12)));
}

TEST(AskedLeasesTest, AHostThatAsksWithoutEndWaitsWithTheNewestOfItsWorkers) {
  AskedLeases asked;
  for (std::uint64_t number = 1; number <= 10'000; ++number) asked.Put(1, AskFor(1, number));
  ASSERT_TRUE(asked.Begin());
  EXPECT_THAT(GivenBy(asked), ElementsAre(Pair(1, 10'000)));
  for (std::uint64_t worker = 1; worker <= kMaxNamedWorkers + 10; ++worker) asked.Put(1, AskFor(worker, worker));
  ASSERT_TRUE(asked.Begin());
  EXPECT_EQ(asked.End(true).size(), kMaxNamedWorkers);
}

}  // namespace
}  // namespace tessera::control
