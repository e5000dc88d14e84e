#include "agent/game_modules.h"

#include <spdlog/spdlog.h>
#include <sys/stat.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <set>
#include <sstream>
#include <system_error>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/strip.h"
#include "agent/limits.h"
#include "core/game/native_name.h"
#include "host/last_lines.h"
#include "host/process.h"
#include "telemetry/logging.h"

namespace tessera::agent {
namespace {

namespace fs = std::filesystem;

constexpr char kSuffix[] = ".so";
constexpr std::size_t kLinesOfDescription = 8, kMaxFailureBytes = 200;

}  // namespace

v1::GameModule ReadDescription(const std::string& name, const std::vector<std::string>& lines, const std::string& end,
                               bool ended_well) {
  v1::GameModule module;
  module.set_name(name);
  const std::string about = absl::StrCat("game module ", name);
  for (const std::string& line : lines) {
    std::istringstream words(line);
    std::string game, kind, named, abi_word, hash_word, hash, with_word, with;
    std::uint32_t abi = 0;
    if (!(words >> game >> kind >> named >> abi_word >> abi >> hash_word >> hash)) continue;
    if (absl::StrCat(game, " ", kind, " ", named) != about || !game::IsModuleHash(hash) || !ended_well) continue;
    module.set_abi(abi);
    module.set_hash(hash);
    // A worker's program of an earlier release says no more, and loads games alone.
    if (words >> with_word >> with && with_word == "with") {
      module.set_no_game(with == "movement");
      module.set_movement(with != "game");
    }
    return module;
  }
  absl::string_view why = lines.empty() ? absl::string_view(end) : absl::string_view(lines.back());
  absl::ConsumePrefix(&why, "tessera-region: ");
  absl::ConsumePrefix(&why, absl::StrCat(about, ": "));
  module.set_failure(std::string(why.substr(0, kMaxFailureBytes)));
  if (module.failure().empty()) module.set_failure(end);
  return module;
}

bool GameModules::Scan() {
  if (options_.folder.empty()) return false;
  const std::map<std::string, FileState> files = Files();
  std::map<std::string, Known> known;
  v1::GameModuleList list;
  for (const auto& [name, file] : files) {
    const auto before = known_.find(name);
    const bool same = before != known_.end() && before->second.file == file;
    Known& entry = known[name];
    entry = same ? before->second : Known{file, Describe(name)};
    *list.add_modules() = entry.module;
    if (same) continue;
    spdlog::log(entry.module.failure().empty() ? spdlog::level::info : spdlog::level::err,
                "game module name={} hash={} abi={} failure={}", name, entry.module.hash(), entry.module.abi(),
                telemetry::LogValue(entry.module.failure()));
  }
  known_ = std::move(known);
  const bool differs = list.SerializeAsString() != list_.SerializeAsString();
  list_ = std::move(list);
  return differs;
}

// The modules' files by name, as many as a host may offer.
std::map<std::string, GameModules::FileState> GameModules::Files() {
  std::map<std::string, FileState> files;
  std::set<std::string> passed_over;
  std::error_code error;
  for (fs::directory_iterator at(options_.folder, error), end; !error && at != end; at.increment(error)) {
    const fs::path& path = at->path();
    struct stat status {};
    if (path.extension() != kSuffix || stat(path.c_str(), &status) != 0 || !S_ISREG(status.st_mode)) continue;
    const std::string name = path.stem().string();
    if (!game::CheckModuleName(name).ok()) {
      passed_over.insert(path.filename().string());
      continue;
    }
    files[name] = {status.st_ino, static_cast<std::uint64_t>(status.st_size),
                   std::int64_t{status.st_mtim.tv_sec} * 1'000'000'000 + status.st_mtim.tv_nsec};
  }
  while (files.size() > game::kMaxGameModules) {
    passed_over.insert(absl::StrCat(std::prev(files.end())->first, kSuffix));
    files.erase(std::prev(files.end()));
  }
  std::string complaint = error ? error.message() : "";
  if (!passed_over.empty()) {
    complaint = absl::StrCat("passed over, as a name is 1 to 63 letters, digits, '_' and '-', and a host has at most ",
                             game::kMaxGameModules, " modules: ", absl::StrJoin(passed_over, ", "));
  }
  if (complaint != complaint_ && !complaint.empty()) {
    spdlog::warn("game modules folder={} problem={}", telemetry::LogValue(options_.folder),
                 telemetry::LogValue(complaint));
  }
  complaint_ = std::move(complaint);
  return files;
}

v1::GameModule GameModules::Describe(const std::string& name) const {
  std::error_code ignored;
  fs::remove(options_.scratch, ignored);
  const auto process = host::Process::Spawn(
      {.argv = {options_.region_binary, "--describe-game-module", absl::StrCat(options_.folder, "/", name, kSuffix)},
       .log_path = options_.scratch,
       .parent_death_signal = SIGKILL});
  if (!process.ok()) return ReadDescription(name, {}, std::string(process.status().message()), false);
  const bool in_time = process->WaitUntilEnded(kModulePatience);
  if (!in_time) process->Signal(SIGKILL);
  const host::ExitStatus status = process->Reap();
  const std::vector<std::string> lines = host::LastLines(options_.scratch, kLinesOfDescription);
  fs::remove(options_.scratch, ignored);
  if (!in_time) return ReadDescription(name, {}, "does not load in time", false);
  return ReadDescription(name, lines, status.Describe(), status.Clean());
}

}  // namespace tessera::agent
