#include "bench/games_absent.h"

#include <fmt/format.h>

#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "host/child_process.h"
#include "host/files.h"
#include "host/program_folder.h"
#include "host/temporary_folder.h"

namespace tessera::bench {
namespace {

constexpr std::chrono::minutes kPatience{30};
constexpr std::size_t kMaxProfileBytes = std::size_t{256} << 20;
constexpr std::string_view kTotals = "\ntotals: ";

// Four regions, a grid of cells with as much to do, and bodies that cross; both versions have it.
absl::StatusOr<std::uint64_t> CountInstructions(const std::string& program, bool with_physics) {
  const host::TemporaryFolder folder;
  const std::string profile = folder.path() + "/profile", said = folder.path() + "/said";
  std::vector<std::string> command{"valgrind", "--tool=callgrind", "--callgrind-out-file=" + profile};
  if (!with_physics) command.emplace_back("--toggle-collect=tessera::physics::World::Step(*");
  command.insert(command.end(), {program, "borders", "--only", "handover", "--quick"});
  auto process =
      host::ChildProcess::Start({.argv = std::move(command), .log_path = said, .output_path = folder.path() + "/out"});
  if (!process.ok()) return process.status();
  const auto ended = process->Wait(kPatience);
  if (!ended || !ended->Clean()) {
    return absl::FailedPreconditionError(
        absl::StrCat("valgrind with ", program, ": ", host::ReadFile(said, kMaxProfileBytes).value_or("said nothing")));
  }
  const auto written = host::ReadFile(profile, kMaxProfileBytes);
  if (!written.ok()) return written.status();
  const std::size_t at = written->find(kTotals);
  std::uint64_t count = 0;
  if (at != std::string::npos) {
    const std::string_view rest = std::string_view(*written).substr(at + kTotals.size());
    if (absl::SimpleAtoi(std::string(rest.substr(0, rest.find('\n'))), &count) && count > 0) return count;
  }
  return absl::DataLossError(absl::StrCat("valgrind with ", program, ": its profile has no totals"));
}

}  // namespace

absl::Status MeasureAbsent(Report& report) {
  const char* const other = std::getenv(kOtherBenchEnvironment);
  if (other == nullptr || *other == '\0') {
    std::cerr << "games: absent: not measured; it needs " << kOtherBenchEnvironment
              << "=PATH/tessera-bench of the version to compare with\n";
    return absl::OkStatus();
  }
  for (const bool with_physics : {true, false}) {
    const auto ours = CountInstructions(host::ProgramFolder() + "/tessera-bench", with_physics);
    if (!ours.ok()) return ours.status();
    const auto theirs = CountInstructions(other, with_physics);
    if (!theirs.ok()) return theirs.status();
    const double ratio = static_cast<double>(*ours) / static_cast<double>(*theirs);
    const char* const config = with_physics ? "all" : "outside physics";
    report.Add("absent", "tessera", config, "game_absent_ratio", ratio, "1");
    std::cerr << fmt::format("games: absent: {}: {} against {} instructions, ratio {:.4f}\n", config, *ours, *theirs,
                             ratio);
  }
  return absl::OkStatus();
}

}  // namespace tessera::bench
