#include "tests/end_to_end/run_program.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

namespace tessera::end_to_end {
namespace {

using Clock = std::chrono::steady_clock;

// Reads both pipes until they close. False when the deadline came first.
bool Drain(std::array<pollfd, 2> pipes, std::array<std::string*, 2> texts, Clock::time_point deadline) {
  int open_pipes = 2;
  while (open_pipes > 0) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now()).count();
    if (left <= 0) return false;
    if (poll(pipes.data(), pipes.size(), static_cast<int>(left)) < 0) continue;
    for (std::size_t i = 0; i < pipes.size(); ++i) {
      if (pipes[i].fd < 0 || (pipes[i].revents & (POLLIN | POLLHUP)) == 0) continue;
      std::array<char, 4096> buffer;
      const ssize_t n = read(pipes[i].fd, buffer.data(), buffer.size());
      if (n > 0) {
        texts[i]->append(buffer.data(), static_cast<std::size_t>(n));
      } else {
        pipes[i].fd = -1;
        --open_pipes;
      }
    }
  }
  return true;
}

}  // namespace

RunResult RunProgram(const std::string& program, const std::vector<std::string>& arguments,
                     std::chrono::seconds timeout) {
  std::array<int, 2> out{}, err{};
  RunResult result;
  if (pipe2(out.data(), O_CLOEXEC) != 0 || pipe2(err.data(), O_CLOEXEC) != 0) return result;
  const std::string path = BinaryPath(program);
  std::vector<char*> raw{const_cast<char*>(path.c_str())};
  for (const std::string& argument : arguments) raw.push_back(const_cast<char*>(argument.c_str()));
  raw.push_back(nullptr);
  const pid_t pid = fork();
  if (pid == 0) {
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    dup2(out[1], STDOUT_FILENO);
    dup2(err[1], STDERR_FILENO);
    execv(raw[0], raw.data());
    _exit(127);
  }
  close(out[1]);
  close(err[1]);
  const bool in_time =
      Drain({pollfd{out[0], POLLIN, 0}, pollfd{err[0], POLLIN, 0}}, {&result.out, &result.err}, Clock::now() + timeout);
  close(out[0]);
  close(err[0]);
  if (!in_time) kill(pid, SIGKILL);
  int status = 0;
  waitpid(pid, &status, 0);
  if (in_time && WIFEXITED(status)) result.exit_code = WEXITSTATUS(status);
  return result;
}

std::string BinaryPath(const std::string& program) { return std::string(TESSERA_BINARY_DIR) + "/bin/" + program; }

std::string ScenePath(const std::string& name) {
  return std::string(TESSERA_SOURCE_DIR) + "/scenes/" + name + ".textproto";
}

std::vector<int> DescendantsOf(int root) {
  std::multimap<int, int> children;
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    std::ifstream stat(entry.path() / "stat");
    std::string text((std::istreambuf_iterator<char>(stat)), {});
    const auto paren = text.rfind(')');
    if (paren == std::string::npos) continue;
    char state = 0;
    int parent = 0;
    std::istringstream(text.substr(paren + 1)) >> state >> parent;
    children.emplace(parent, std::stoi(text));
  }
  std::vector<int> found{root};
  for (std::size_t i = 0; i < found.size(); ++i) {
    const auto [first, last] = children.equal_range(found[i]);
    for (auto it = first; it != last; ++it) found.push_back(it->second);
  }
  found.erase(found.begin());
  return found;
}

bool IsAlive(int pid) {
  std::ifstream stat("/proc/" + std::to_string(pid) + "/stat");
  std::string text((std::istreambuf_iterator<char>(stat)), {});
  const auto paren = text.rfind(')');
  return paren != std::string::npos && text.size() > paren + 2 && text[paren + 2] != 'Z';
}

}  // namespace tessera::end_to_end
