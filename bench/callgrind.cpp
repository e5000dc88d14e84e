#include "bench/callgrind.h"

#include <chrono>
#include <cstddef>
#include <string_view>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "host/child_process.h"
#include "host/files.h"
#include "host/temporary_folder.h"

namespace tessera::bench {
namespace {

constexpr char kValgrindPath[] = "/usr/bin/valgrind";
constexpr std::chrono::minutes kPatience{30};
constexpr std::size_t kMaxProfileBytes = std::size_t{256} << 20;
constexpr std::string_view kTotals = "\ntotals: ";

}  // namespace

absl::StatusOr<std::uint64_t> CountInstructions(const std::vector<std::string>& command, const Counted& counted) {
  const host::TemporaryFolder folder;
  const std::string profile = folder.path() + "/profile", said = folder.path() + "/said";
  std::vector<std::string> argv{kValgrindPath, "--tool=callgrind", "--callgrind-out-file=" + profile};
  if (counted.where != Counted::Where::kEverywhere) {
    argv.push_back("--toggle-collect=" + counted.function);
    // The option above has turned counting off until the function is entered.
    if (counted.where == Counted::Where::kOutside) argv.emplace_back("--collect-atstart=yes");
  }
  argv.insert(argv.end(), command.begin(), command.end());
  auto process =
      host::ChildProcess::Start({.argv = std::move(argv), .log_path = said, .output_path = folder.path() + "/out"});
  if (!process.ok()) return process.status();
  const auto ended = process->Wait(kPatience);
  if (!ended || !ended->Clean()) {
    return absl::FailedPreconditionError(absl::StrCat("valgrind with ", command.front(), ": ",
                                                      host::ReadFile(said, kMaxProfileBytes).value_or("said nothing")));
  }
  const auto written = host::ReadFile(profile, kMaxProfileBytes);
  if (!written.ok()) return written.status();
  const std::size_t at = written->find(kTotals);
  std::uint64_t count = 0;
  if (at != std::string::npos) {
    const std::string_view rest = std::string_view(*written).substr(at + kTotals.size());
    if (absl::SimpleAtoi(std::string(rest.substr(0, rest.find('\n'))), &count) && count > 0) return count;
  }
  return absl::DataLossError(absl::StrCat("valgrind with ", command.front(), ": its profile has no count"));
}

}  // namespace tessera::bench
