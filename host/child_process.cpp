#include "host/child_process.h"

#include <csignal>
#include <filesystem>

#include "host/file_watch.h"

namespace tessera::host {

absl::StatusOr<ChildProcess> ChildProcess::Start(ProcessSpec spec) {
  if (spec.parent_death_signal == 0) spec.parent_death_signal = SIGTERM;
  absl::StatusOr<Process> process = Process::Spawn(spec);
  if (!process.ok()) return process.status();
  return ChildProcess(*std::move(process));
}

// The other object ends what this one held.
ChildProcess& ChildProcess::operator=(ChildProcess&& other) noexcept {
  std::swap(process_, other.process_);
  std::swap(ended_, other.ended_);
  return *this;
}

ChildProcess::~ChildProcess() {
  if (process_.pidfd() >= 0) End(std::chrono::seconds(10));
}

std::optional<ExitStatus> ChildProcess::Wait(std::chrono::milliseconds timeout) {
  if (!ended_ && process_.WaitUntilEnded(timeout)) ended_ = process_.Reap();
  return ended_;
}

ExitStatus ChildProcess::End(std::chrono::milliseconds patience) {
  Signal(SIGTERM);
  if (!Wait(patience)) Signal(SIGKILL);
  while (!Wait(std::chrono::seconds(1))) {
  }
  return *ended_;
}

bool ChildProcess::WaitForFile(const std::string& path, std::chrono::milliseconds timeout) {
  const auto deadline = std::chrono::steady_clock::now() + timeout;
  FileWatch folder(std::filesystem::path(path).parent_path());
  while (!std::filesystem::exists(path)) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
    if (Wait(std::chrono::milliseconds(0)) || !folder.Wait(left, process_.pidfd())) {
      return std::filesystem::exists(path);
    }
  }
  return true;
}

}  // namespace tessera::host
