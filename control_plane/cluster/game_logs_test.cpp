// Lines of games from reports alone.
#include "control_plane/cluster/game_logs.h"

#include <gmock/gmock.h>

#include "absl/strings/str_cat.h"
#include "control_plane/testing/state_rig.h"

namespace tessera::control {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class GameLogsTest : public ::testing::Test {
 protected:
  GameLogsTest() {
    records::Instance next = instance_.record;
    next.set_game_name("game.lua");
    next.set_game_hash("feed");
    EXPECT_TRUE(rig_.state->StoreInstance(instance_, next).ok());
  }
  // Reports lines numbered from `first` on.
  void Report(std::uint32_t region, std::uint64_t first, const std::vector<std::string>& texts, bool error = false,
              bool off = false, std::uint64_t incarnation = 1) {
    v1::WorkerReport report;
    report.mutable_identity()->set_region(region);
    report.mutable_identity()->set_incarnation(incarnation);
    for (const std::string& text : texts) {
      v1::GameLine& line = *report.add_game_lines();
      line.set_number(first++);
      line.set_tick(60);
      line.set_error(error);
      line.set_callback_off(off);
      line.set_text(text);
    }
    logs_.Take(instance_, report, rig_.now);
  }
  std::vector<std::string> Lines(std::uint64_t after = 0) const {
    std::vector<std::string> lines;
    for (const v1::GameLogLine& line : logs_.After(instance_, after)) {
      lines.push_back(absl::StrCat(line.region(), " ", line.line().text()));
    }
    return lines;
  }
  std::vector<std::string> Events() const {
    std::vector<std::string> events;
    for (const v1::InstanceEvent& event : instance_.record.events()) events.push_back(event.text());
    return events;
  }

  StateRig rig_;
  HostEntry& alpha_ = rig_.AddHost("alpha");
  InstanceEntry& instance_ = rig_.AddRunning({&alpha_, &alpha_});
  GameLogs logs_{*rig_.state};
};

TEST_F(GameLogsTest, ALineThatIsReportedAgainIsKeptOnce) {
  Report(1, 1, {"a", "b"});
  Report(2, 1, {"x"});
  Report(1, 1, {"a", "b", "c"});
  EXPECT_THAT(Lines(), ElementsAre("1 a", "1 b", "2 x", "1 c"));
  EXPECT_THAT(Events(), IsEmpty()) << "what a game prints is nobody's trouble";
}

TEST_F(GameLogsTest, AReaderGetsWhatCameAfterItsLastLine) {
  Report(1, 1, {"a", "b"});
  const std::uint64_t last = logs_.After(instance_, 0).back().number();
  EXPECT_THAT(Lines(last), IsEmpty());
  Report(2, 1, {"x"});
  EXPECT_THAT(Lines(last), ElementsAre("2 x"));
}

TEST_F(GameLogsTest, AnotherLifeOfARegionCountsAnew) {
  Report(1, 1, {"a", "b"});
  Report(1, 1, {"again"}, false, false, 2);
  EXPECT_THAT(Lines(), ElementsAre("1 a", "1 b", "1 again"));
}

TEST_F(GameLogsTest, OnlyTheNewestLinesAreKeptEachOnOneLine) {
  for (std::uint64_t i = 1; i <= kMaxGameLines + 5; ++i) Report(1, i, {absl::StrCat("line\n", i)});
  const auto lines = Lines();
  ASSERT_THAT(lines, SizeIs(kMaxGameLines));
  EXPECT_EQ(lines.front(), "1 line 6");
  Report(2, 1, {std::string(10 * kMaxGameLineBytes, 'x')});
  EXPECT_THAT(Lines().back(), SizeIs(kMaxGameLineBytes + 2));
}

TEST_F(GameLogsTest, TheFirstErrorAfterASilenceAndEachCallbackThatIsOffAreEvents) {
  Report(1, 1, {"game.lua:3: no", "game.lua:4: no"}, true);
  EXPECT_THAT(Events(), ElementsAre("game in region 1, tick 60: game.lua:3: no"));
  Report(2, 1, {"on_tick failed 20 times in a row and is off"}, true, true);
  EXPECT_THAT(Events(), ElementsAre(HasSubstr("game.lua:3"), HasSubstr("region 2, tick 60: on_tick failed 20")));
  for (std::uint64_t i = 3; i < 10; ++i) {
    rig_.Pass(kGameErrorSilence / 2);
    Report(1, i, {"game.lua:5: no"}, true);
  }
  EXPECT_THAT(Events(), SizeIs(2)) << "it has not stopped failing";
  rig_.Pass(kGameErrorSilence);
  Report(1, 10, {"game.lua:6: no"}, true);
  EXPECT_THAT(Events(), SizeIs(3));
}

TEST_F(GameLogsTest, NoHostMakesEventsWithoutEnd) {
  for (std::uint64_t i = 1; i <= 1000; ++i) Report(1, i, {"off"}, true, true);
  records::Instance next = instance_.record;
  next.clear_events();
  ASSERT_TRUE(rig_.state->StoreInstance(instance_, next).ok());
  Report(1, 1001, {"off"}, true, true);
  EXPECT_THAT(Events(), IsEmpty());
}

TEST_F(GameLogsTest, AWorldWithoutAGameHasNoLines) {
  records::Instance next = instance_.record;
  next.clear_game_hash();
  ASSERT_TRUE(rig_.state->StoreInstance(instance_, next).ok());
  Report(1, 1, {"made up"});
  EXPECT_THAT(Lines(), IsEmpty());
}

}  // namespace
}  // namespace tessera::control
