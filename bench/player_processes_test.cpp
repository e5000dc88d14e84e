#include "bench/player_processes.h"

#include <gtest/gtest.h>
#include <poll.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace tessera::bench {
namespace {

using Clock = PlayerProcesses::Clock;

constexpr std::chrono::seconds kScriptPatience{20};

// A player that says these things, and answers each order to watch as the script does.
std::vector<std::string> Script(const std::string& text) { return {"/bin/sh", "-c", text}; }

std::unique_ptr<PlayerProcesses> StartScripts(const std::vector<std::string>& scripts) {
  std::vector<std::vector<std::string>> commands;
  commands.reserve(scripts.size());
  for (const std::string& script : scripts) commands.push_back(Script(script));
  auto players = PlayerProcesses::Start(commands);
  EXPECT_TRUE(players.ok()) << players.status();
  return players.ok() ? *std::move(players) : nullptr;
}

// Its last status, once it holds or is not OK; DEADLINE_EXCEEDED if neither comes.
absl::Status TakeInUntil(PlayerProcesses& players, const std::function<bool()>& holds) {
  const auto deadline = Clock::now() + kScriptPatience;
  while (Clock::now() < deadline) {
    if (absl::Status status = players.TakeIn(Clock::now()); !status.ok() || holds()) return status;
    poll(nullptr, 0, 1);
  }
  return absl::DeadlineExceededError("it did not come");
}

TEST(PlayerProcessesTest, PlayersAreInOnceEachSeesItsBody) {
  const auto players = StartScripts(
      {"echo in 1000001 30; echo frames 100 2; read end", "echo in 1000002 31; echo frames 50 1; read end"});
  ASSERT_NE(players, nullptr);
  const absl::Status status = TakeInUntil(*players, [&] { return players->AllIn() && players->frames().due == 150; });
  EXPECT_TRUE(status.ok()) << status;
  EXPECT_EQ(players->frames().late, 3U);
  EXPECT_EQ(players->views()[1]->body(), BodyId(1'000'002));
  EXPECT_EQ(players->ended(), 0U);
}

TEST(PlayerProcessesTest, TellsTheMedianAndTheWorstOfThePlayersGaps) {
  const auto answer = [](const std::string& gap) {
    return "read watch number region; echo gap $number " + gap + "; read end";
  };
  const auto players = StartScripts({answer("40 1 .05"), answer("12 1 .25"), answer("7 1 .1"),
                                     "read watch number region; echo gap $number 0 0 0; read end"});
  ASSERT_NE(players, nullptr);
  players->Watch({RegionId(2)});
  EXPECT_FALSE(players->SawOthers());
  const auto is_over = [](const PlayerView* view) { return view->gap().over; };
  const absl::Status status =
      TakeInUntil(*players, [&] { return std::ranges::count_if(players->views(), is_over) == 3; });
  EXPECT_TRUE(status.ok()) << status;
  EXPECT_TRUE(players->SawOthers());
  EXPECT_DOUBLE_EQ(players->worst_gap_s(), 0.25);
  EXPECT_DOUBLE_EQ(players->gap_s(), 0.1) << "who was shown none of those bodies does not count";
}

TEST(PlayerProcessesTest, APlayerWhoIsOutIsAnErrorWithItsReason) {
  const auto players = StartScripts({"read end", "echo ended DEADLINE_EXCEEDED: silence"});
  ASSERT_NE(players, nullptr);
  const absl::Status status = TakeInUntil(*players, [] { return false; });
  EXPECT_EQ(status.message(), "player 2: DEADLINE_EXCEEDED: silence");
  EXPECT_EQ(players->ended(), 1U);
}

TEST(PlayerProcessesTest, AProcessThatEndsUnaskedIsAPlayerWhoIsOut) {
  const auto players = StartScripts({"exit 3"});
  ASSERT_NE(players, nullptr);
  EXPECT_EQ(TakeInUntil(*players, [] { return false; }).message(), "player 1: its process has ended");
}

TEST(PlayerProcessesTest, NonsenseIsAnError) {
  const auto players = StartScripts({"echo hello; read end"});
  ASSERT_NE(players, nullptr);
  EXPECT_EQ(TakeInUntil(*players, [] { return false; }).code(), absl::StatusCode::kInternal);
}

TEST(PlayerProcessesTest, AProgramThatIsNotThereIsNamed) {
  const auto players = PlayerProcesses::Start({{"/nowhere/tessera-bench", "player"}});
  ASSERT_FALSE(players.ok());
  EXPECT_NE(players.status().message().find("/nowhere/tessera-bench"), std::string::npos);
}

}  // namespace
}  // namespace tessera::bench
