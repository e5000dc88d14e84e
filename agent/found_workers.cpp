#include "agent/found_workers.h"

#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <system_error>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "agent/supervisor.h"
#include "host/files.h"
#include "host/process.h"
#include "telemetry/logging.h"

namespace tessera::agent {
namespace {

constexpr std::size_t kMaxCommandBytes = 1 << 18;  // a worker's has some hundred bytes
constexpr std::uint32_t kHighestPort = 65535;

// True if the process is this user's: "Uid:\treal\teffective\t...".
bool IsOwn(const std::string& status) {
  const std::size_t line = status.find("\nUid:");
  if (line == std::string::npos) return false;
  const std::vector<std::string> ids =
      absl::StrSplit(status.substr(line + 5, status.find('\n', line + 1) - line - 5), '\t', absl::SkipEmpty());
  return !ids.empty() && ids.front() == std::to_string(geteuid());
}

}  // namespace

std::optional<WorkerRecord> WorkerOf(const std::vector<std::string>& arguments, const std::string& socket_path) {
  std::map<std::string, std::string> values;
  for (std::size_t i = 0; i + 1 < arguments.size(); ++i) {
    if (arguments[i].starts_with("--")) values.try_emplace(arguments[i], arguments[i + 1]);
  }
  WorkerRecord record;
  std::uint32_t region = 0, port = 0;
  std::uint64_t incarnation = 0;
  if (values["--agent-socket"] != socket_path || !IsInstanceId(values["--instance"]) ||
      !absl::SimpleAtoi(values["--region"], &region) || !absl::SimpleAtoi(values["--incarnation"], &incarnation) ||
      !absl::SimpleAtoi(values["--game-port"], &port) || region == 0 || incarnation == 0 || port == 0 ||
      port > kHighestPort) {
    return std::nullopt;
  }
  record.mutable_identity()->set_instance_id(values["--instance"]);
  record.mutable_identity()->set_region(region);
  record.mutable_identity()->set_incarnation(incarnation);
  record.set_first_port(port);
  return record;
}

std::vector<WorkerRecord> FindWorkers(const std::string& socket_path, const std::string& proc) {
  std::map<WorkerKey, WorkerRecord> found;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(proc, error)) {
    pid_t pid = 0;
    if (!absl::SimpleAtoi(entry.path().filename().string(), &pid) || pid == getpid()) continue;
    // A process may end while it is looked at, and is none of ours then.
    const auto command = host::ReadFile(entry.path().string() + "/cmdline", kMaxCommandBytes);
    if (!command.ok()) continue;
    auto record = WorkerOf(absl::StrSplit(*command, '\0'), socket_path);
    if (!record) continue;
    const auto status = host::ReadFile(entry.path().string() + "/status", kMaxCommandBytes);
    const auto start_time = host::ProcessStartTime(pid);
    if (!status.ok() || !IsOwn(*status) || !start_time) continue;
    record->mutable_identity()->set_pid(pid);
    record->set_start_time(*start_time);
    const auto [place, is_new] = found.try_emplace(KeyOf(record->identity()), *record);
    if (is_new) continue;
    WorkerRecord& first = place->second;
    if (*start_time < first.start_time()) std::swap(first, *record);
    spdlog::error("two processes claim to be one worker worker={} taken={} passed_over={}",
                  telemetry::LogValue(place->first.ToString()), first.identity().pid(), record->identity().pid());
  }
  std::vector<WorkerRecord> records;
  records.reserve(found.size());
  for (auto& [key, record] : found) records.push_back(std::move(record));
  std::sort(records.begin(), records.end(),
            [](const auto& a, const auto& b) { return a.identity().pid() < b.identity().pid(); });
  return records;
}

}  // namespace tessera::agent
