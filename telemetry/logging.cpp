#include "telemetry/logging.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <utility>

#include "absl/strings/str_cat.h"
#include "host/log_rotation.h"
#include "spdlog/pattern_formatter.h"
#include "spdlog/sinks/base_sink.h"
#include "spdlog/sinks/stdout_sinks.h"
#include "spdlog/spdlog.h"

namespace tessera::telemetry {
namespace {

constexpr std::array<std::pair<std::string_view, spdlog::level::level_enum>, 6> kLevels = {{
    {"trace", spdlog::level::trace},
    {"debug", spdlog::level::debug},
    {"info", spdlog::level::info},
    {"warning", spdlog::level::warn},
    {"error", spdlog::level::err},
    {"off", spdlog::level::off},
}};

// True if systemd's journal reads what we write to stderr: JOURNAL_STREAM names the device and inode of its socket, and
// a process that was started by a service may have inherited the variable, but not the socket (systemd.exec(5)).
bool StderrIsJournal() {
  const char* const stream = std::getenv("JOURNAL_STREAM");
  struct stat opened {};
  if (stream == nullptr || fstat(STDERR_FILENO, &opened) != 0) return false;
  return std::string(stream) == absl::StrCat(opened.st_dev, ":", opened.st_ino);
}

// "<4>": the journal takes it for the priority of the line, as syslog counts them (sd-daemon(3)).
class JournalPriority final : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm& /*time*/, spdlog::memory_buf_t& line) override {
    const char priority = message.level >= spdlog::level::err    ? '3'
                          : message.level == spdlog::level::warn ? '4'
                          : message.level == spdlog::level::info ? '6'
                                                                 : '7';
    for (const char letter : {'<', priority, '>'}) line.push_back(letter);
  }
  std::unique_ptr<custom_flag_formatter> clone() const override { return std::make_unique<JournalPriority>(); }
};

bool IsSameFile(int one, int other) {
  struct stat first {
  }, second{};
  return fstat(one, &first) == 0 && fstat(other, &second) == 0 && first.st_dev == second.st_dev &&
         first.st_ino == second.st_ino;
}

// The file that stderr is, if this process is known to be its only writer.
std::string LogFile() {
  const char* path = std::getenv(host::kLogFileEnvironment);
  if (path == nullptr) return "";
  const int fd = open(path, O_WRONLY | O_APPEND | O_CLOEXEC);
  if (fd < 0) return "";
  struct stat file {};
  const bool is_stderr = fstat(fd, &file) == 0 && S_ISREG(file.st_mode) && IsSameFile(fd, STDERR_FILENO);
  close(fd);
  return is_stderr ? path : "";
}

// Writes to stderr, which is the file at `path`, and rotates it.
class RotatingSink final : public spdlog::sinks::base_sink<std::mutex> {
 public:
  explicit RotatingSink(std::string path) : path_(std::move(path)) {}

 private:
  void sink_it_(const spdlog::details::log_msg& message) override {
    spdlog::memory_buf_t line;
    formatter_->format(message, line);
    std::fwrite(line.data(), 1, line.size(), stderr);
    // Text that the C library writes counts too, so the file's size is asked for.
    struct stat file {};
    if (fstat(STDERR_FILENO, &file) == 0 && static_cast<std::uint64_t>(file.st_size) >= host::kMaxLogBytes) Rotate();
  }
  void flush_() override { std::fflush(stderr); }

  void Rotate() {
    std::fflush(stderr);
    if (!host::RotateLogIfLarge(path_)) return;
    const int fd = open(path_.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
    if (fd < 0) return;  // it goes on in the one that was renamed
    const bool is_output = IsSameFile(STDOUT_FILENO, STDERR_FILENO);
    if (is_output) dup2(fd, STDOUT_FILENO);
    dup2(fd, STDERR_FILENO);
    close(fd);
  }

  const std::string path_;
};

}  // namespace

absl::Status InitLogging(const std::string& component, std::string_view flag) {
  std::string level = "info";  // Debian builds Abseil with a string_view of its own, so StrCat takes no std one
  std::string source = "default";
  const char* environment = std::getenv(kLogEnvironment);
  if (!flag.empty()) {
    level = std::string(flag);
    source = "--log-level";
  } else if (environment != nullptr && *environment != '\0') {
    level = environment;
    source = kLogEnvironment;
  }
  const auto* const found =
      std::find_if(kLevels.begin(), kLevels.end(), [&](const auto& l) { return l.first == level; });
  if (found == kLevels.end()) {
    return absl::InvalidArgumentError(absl::StrCat(source, ": unknown log level ", LogValue(level),
                                                   "; use trace, debug, info, warning, error or off"));
  }
  spdlog::sink_ptr sink = std::make_shared<spdlog::sinks::stderr_sink_mt>();
  if (const std::string log_file = LogFile(); !log_file.empty()) sink = std::make_shared<RotatingSink>(log_file);
  auto logger = std::make_shared<spdlog::logger>(component, std::move(sink));
  auto form = std::make_unique<spdlog::pattern_formatter>(spdlog::pattern_time_type::utc);
  form->add_flag<JournalPriority>('*').set_pattern(std::string(StderrIsJournal() ? "%*" : "") +
                                                   "%Y-%m-%dT%H:%M:%S.%eZ %l %n: %v");
  logger->set_formatter(std::move(form));
  logger->set_level(found->second);
  logger->flush_on(spdlog::level::trace);  // a line about a crash must not die in a buffer
  spdlog::set_default_logger(std::move(logger));
  return absl::OkStatus();
}

}  // namespace tessera::telemetry
