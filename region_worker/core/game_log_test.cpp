#include "region_worker/core/game_log.h"

#include <gmock/gmock.h>

#include "region_worker/testing/small_world.h"

namespace tessera::worker {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class GameLogTest : public ::testing::Test {
 protected:
  std::vector<std::string> Take(std::vector<game::GameLine> lines) {
    Actions actions;
    log.Take(std::move(lines), now, actions);
    std::vector<std::string> written;
    for (const Log& line : AllOf<Log>(actions)) {
      written.push_back((line.severity == Severity::kWarning ? "warning: " : "") + line.line);
    }
    return written;
  }
  static std::vector<game::GameLine> Many(int count) {
    return std::vector<game::GameLine>(static_cast<std::size_t>(count), {Tick(1), BodyId(), false, "hello"});
  }
  v1::WorkerReport Reported() const {
    v1::WorkerReport report;
    log.Report(report);
    return report;
  }

  GameLog log;
  TimePoint now{std::chrono::hours(1)};
};

TEST_F(GameLogTest, LinesSayWhenAndAboutWhom) {
  EXPECT_THAT(Take({{Tick(12), BodyId(), false, "round 2 begins"}, {Tick(12), BodyId(7), true, "game.lua:3: no"}}),
              ElementsAre("game tick=12 text=\"round 2 begins\"",
                          "warning: game error tick=12 body=7 text=\"game.lua:3: no\""));
  const v1::WorkerReport report = Reported();
  ASSERT_EQ(report.game_lines_size(), 2);
  EXPECT_EQ(report.game_lines(0).number(), 1u);
  EXPECT_EQ(report.game_lines(1).number(), 2u);
  EXPECT_EQ(report.game_lines(1).body(), 7u);
  EXPECT_TRUE(report.game_lines(1).error());
  EXPECT_EQ(report.game_lines(1).text(), "game.lua:3: no");
}

TEST_F(GameLogTest, ALineCannotForgeAnother) {
  const auto written = Take({{Tick(1), BodyId(), false, "a\n[error] b"}});
  ASSERT_THAT(written, SizeIs(1));
  EXPECT_THAT(written[0], ::testing::Not(HasSubstr("\n")));
}

TEST_F(GameLogTest, AGameThatWritesTooMuchIsHeldBackAndTheLogSaysSo) {
  EXPECT_THAT(Take(Many(500)), SizeIs(GameLog::kBurst));
  EXPECT_EQ(log.left_out(), 400u);
  EXPECT_THAT(Take(Many(1)), IsEmpty());
  now += std::chrono::seconds(1);
  const auto later = Take(Many(500));
  ASSERT_THAT(later, SizeIs(GameLog::kLinesPerSecond + 1));
  EXPECT_EQ(later[0], "warning: game lines left out count=401");
}

TEST_F(GameLogTest, ACallbackThatIsOffIsAlwaysSaid) {
  Take(Many(500));
  EXPECT_THAT(Take({{Tick(2), BodyId(), true, "on_tick failed 20 times in a row and is off", true}}),
              ::testing::Contains(HasSubstr("is off")));
  EXPECT_TRUE(Reported().game_lines().rbegin()->callback_off());
}

TEST_F(GameLogTest, ReportsRepeatTheNewestAndTheirNumbersShowWhatIsMissing) {
  Take(Many(90));
  const v1::WorkerReport report = Reported();
  ASSERT_EQ(report.game_lines_size(), static_cast<int>(GameLog::kReported));
  EXPECT_EQ(report.game_lines().rbegin()->number(), 90u);
  EXPECT_EQ(report.game_lines(0).number(), 90u - GameLog::kReported + 1);
}

}  // namespace
}  // namespace tessera::worker
