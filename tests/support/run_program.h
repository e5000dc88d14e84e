// Runs a program of this build to its end and keeps what it said.
#pragma once

#include <chrono>
#include <string>
#include <vector>

namespace tessera::support {

struct RunResult {
  int exit_code = -1;  // -1: ended by a signal, or killed because it took longer than `timeout`
  std::string out, err;
};

// `program` is a name in the build's bin folder ("tessera").
RunResult RunProgram(const std::string& program, const std::vector<std::string>& arguments,
                     std::chrono::seconds timeout = std::chrono::seconds(60));

std::string BinaryPath(const std::string& program);
std::string ScenePath(const std::string& name);

}  // namespace tessera::support
