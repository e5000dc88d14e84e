#include "region_worker/core/drop_log.h"

#include <gmock/gmock.h>

#include <chrono>
#include <cstdint>
#include <numeric>
#include <string>
#include <vector>

#include "region_worker/testing/regions.h"
#include "region_worker/testing/small_world.h"

namespace tessera::worker {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

class DropLogTest : public ::testing::Test {
 protected:
  void Drop(const absl::Status& status) { log.Dropped("frame", kSecond, status, now, actions); }
  std::vector<std::string> TakeLines() {
    std::vector<std::string> lines;
    for (const Log& line : AllOf<Log>(actions)) {
      EXPECT_EQ(line.severity, Severity::kWarning);
      lines.push_back(line.line);
    }
    actions.clear();
    return lines;
  }
  std::uint64_t Counted(DropReason reason) const { return log.counts()[static_cast<std::size_t>(reason)]; }

  DropLog log;
  Actions actions;
  TimePoint now = kStart;
};

TEST_F(DropLogTest, EachReasonIsCountedApart) {
  Drop(absl::PermissionDeniedError("from region 9"));
  Drop(absl::FailedPreconditionError("map 3"));
  Drop(absl::OutOfRangeError("old tick 7"));
  Drop(absl::OutOfRangeError("tick 9 before 8"));
  Drop(absl::InvalidArgumentError("body 4 is static"));
  Drop(absl::InvalidArgumentError("truncated"));
  Drop(absl::InvalidArgumentError("truncated"));
  Drop(absl::InternalError("?"));
  EXPECT_EQ(Counted(DropReason::kNotNeighbor), 1U);
  EXPECT_EQ(Counted(DropReason::kMapVersion), 1U);
  EXPECT_EQ(Counted(DropReason::kOldTick), 1U);
  EXPECT_EQ(Counted(DropReason::kOutOfOrder), 1U);
  EXPECT_EQ(Counted(DropReason::kBadBody), 1U);
  EXPECT_EQ(Counted(DropReason::kMalformed), 2U);
  EXPECT_EQ(Counted(DropReason::kOther), 1U);
  EXPECT_EQ(std::accumulate(log.counts().begin(), log.counts().end(), std::uint64_t{0}), 8U);
}

TEST_F(DropLogTest, OneLineASecondCountsThoseThatHadNone) {
  Drop(absl::InvalidArgumentError("truncated"));
  EXPECT_THAT(TakeLines(), ElementsAre("frame dropped from=2 reason=truncated since_last_line=1"));
  now += DropLog::kLogDistance - std::chrono::nanoseconds(1);
  Drop(absl::InvalidArgumentError("truncated"));
  Drop(absl::InvalidArgumentError("truncated"));
  EXPECT_THAT(TakeLines(), IsEmpty());
  now += std::chrono::nanoseconds(1);
  Drop(absl::OutOfRangeError("old tick 7"));
  EXPECT_THAT(TakeLines(), ElementsAre("frame dropped from=2 reason=\"old tick 7\" since_last_line=3"));
}

}  // namespace
}  // namespace tessera::worker
