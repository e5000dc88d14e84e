// tessera-region: simulates one region of a world. See flags.h for the two ways to start it.
#include <fcntl.h>
#include <malloc.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string>

#include <spdlog/spdlog.h>

#include "game_sdk/native/native_module.h"
#include "host/log_rotation.h"
#include "region_worker/flags.h"
#include "region_worker/sandbox.h"
#include "region_worker/wait.h"
#include "region_worker/worker_shell.h"
#include "telemetry/logging.h"

namespace {

// An allocation arena for each thread would cost memory for nothing: only the loop allocates much.
constexpr int kArenas = 2;

int Exit(int status, const std::string& text) {
  std::fputs(text.c_str(), status == tessera::worker::kExitOk ? stdout : stderr);
  return status;
}

// Everything that the process says goes to the file, what the C library says when it aborts too.
bool RedirectStderr(const std::string& path) {
  const int fd = open(path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (fd < 0) return false;
  const bool done = dup2(fd, STDERR_FILENO) >= 0;
  close(fd);
  return done;
}

// False: it could not be entered, and the log says why. A kernel that lacks a part of it is said, and no reason to end.
bool IntoSandbox(const tessera::worker::WorkerOptions& options) {
  if (!options.sandbox) return true;
  const std::filesystem::path log = std::filesystem::absolute(options.log_file);
  const auto missing = tessera::worker::EnterSandbox({.readable = options.readable,
                                                      .writable = options.writable,
                                                      .append = {log.parent_path().string()},
                                                      .memory_bytes = options.memory_mb << 20});
  if (!missing.ok()) {
    spdlog::error("sandbox refused reason={}", tessera::telemetry::LogValue(std::string(missing.status().message())));
    return false;
  }
  if (!missing->empty()) spdlog::warn("sandbox incomplete missing={}", tessera::telemetry::LogValue(*missing));
  return true;
}

// "game module arena abi 1 hash 9f86d0... with game", or "with movement", or "with both": for an agent, which loads no
// library itself, because one that crashes as it is loaded ends the process.
int DescribeModule(const std::filesystem::path& path) {
  const std::string folder = path.has_parent_path() ? path.parent_path().string() : ".";
  const auto module = tessera::game::NativeModule::LoadAny(folder, path.stem().string());
  if (!module.ok()) {
    return Exit(tessera::worker::kExitFailure, "tessera-region: " + std::string(module.status().message()) + "\n");
  }
  const bool moves = (*module)->movement() != nullptr;
  const std::string with = !(*module)->is_game() ? "movement" : moves ? "both" : "game";
  const int abi = (*module)->is_game() ? TESSERA_GAME_ABI : TESSERA_MOVEMENT_ABI;
  return Exit(tessera::worker::kExitOk, "game module " + (*module)->name() + " abi " + std::to_string(abi) + " hash " +
                                            (*module)->hash() + " with " + with + "\n");
}

}  // namespace

int main(int argc, char** argv) {
  using namespace tessera::worker;
  mallopt(M_ARENA_MAX, kArenas);
  std::signal(SIGPIPE, SIG_IGN);
  const auto parsed = ParseFlags(argc, argv);
  if (const auto* exit_now = std::get_if<ExitNow>(&parsed)) return Exit(exit_now->status, exit_now->text);
  const auto& options = std::get<WorkerOptions>(parsed);
  if (!options.describe_game_module.empty()) return DescribeModule(options.describe_game_module);
  if (!options.log_file.empty()) {
    if (!RedirectStderr(options.log_file)) {
      return Exit(kExitUsage, "tessera-region: --log-file " + options.log_file + ": " + std::strerror(errno) + "\n");
    }
    setenv(tessera::host::kLogFileEnvironment, options.log_file.c_str(), 1);  // before any thread
  }
  if (const absl::Status status = tessera::telemetry::InitLogging("region", options.log_level); !status.ok()) {
    return Exit(kExitUsage, "tessera-region: " + std::string(status.message()) + "\n");
  }
  if (!IntoSandbox(options)) return kExitFailure;
  const SignalWatch signals;  // before any thread
  return WorkerShell(options, signals).Run();
}
