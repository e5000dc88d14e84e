#include "host/testing/watched_program.h"

#include <gtest/gtest.h>

#include <csignal>
#include <cstdio>
#include <utility>

#include "host/file_watch.h"
#include "host/files.h"

namespace tessera::host {
namespace {

constexpr std::size_t kMaxOutputBytes = std::size_t{1} << 28;

ChildProcess StartOrAbort(std::vector<std::string> argv, const std::string& log) {
  auto process = ChildProcess::Start({.argv = std::move(argv), .log_path = log, .parent_death_signal = SIGKILL});
  EXPECT_TRUE(process.ok()) << process.status();
  return *std::move(process);
}

}  // namespace

WatchedProgram::WatchedProgram(std::vector<std::string> argv) : process_(StartOrAbort(std::move(argv), log())) {}

WatchedProgram::~WatchedProgram() {
  if (!Ended()) {
    Signal(SIGKILL);
    Wait();
  }
  if (testing::Test::HasFailure()) std::fprintf(stderr, "--- process %d said:\n%s", pid(), Output().c_str());
}

ExitStatus WatchedProgram::Wait() {
  if (const auto status = process_.Wait(kTestPatience)) return *status;
  ADD_FAILURE() << "did not end:\n" << Output();
  return process_.End(std::chrono::milliseconds(0));
}

std::string WatchedProgram::Output() const { return ReadFile(log(), kMaxOutputBytes).value_or(""); }

bool WatchedProgram::WaitForText(const std::string& text) {
  const auto deadline = std::chrono::steady_clock::now() + kTestPatience;
  FileWatch output(log());
  for (;;) {
    const bool ended = Ended();  // asked first, so that what it wrote at its end is read
    if (Output().find(text) != std::string::npos) return true;
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
    if (ended || !output.Wait(left, process_.pidfd())) return false;
  }
}

}  // namespace tessera::host
