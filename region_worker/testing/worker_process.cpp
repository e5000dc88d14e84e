#include "region_worker/testing/worker_process.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <fstream>
#include <random>

#include "telemetry/http_get.h"

namespace tessera::worker {
namespace {

sockaddr_in Loopback(std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return address;
}

bool IsFree(std::uint16_t port, int type) {
  const int fd = socket(AF_INET, type | SOCK_CLOEXEC, 0);
  const sockaddr_in address = Loopback(port);
  const bool free = bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  close(fd);
  return free;
}

std::vector<std::string> CommandLine(const std::vector<std::string>& arguments) {
  std::vector<std::string> argv = {std::string(TESSERA_BINARY_DIR) + "/bin/tessera-region"};
  argv.insert(argv.end(), arguments.begin(), arguments.end());
  return argv;
}

}  // namespace

WorkerProcess::WorkerProcess(const std::vector<std::string>& arguments) : program_(CommandLine(arguments)) {}

int WorkerProcess::Wait() {
  const host::ExitStatus status = program_.Wait();
  return status.signal == 0 ? status.code : 128 + status.signal;
}

std::string ScenePath(const std::string& name) {
  return std::string(TESSERA_SOURCE_DIR) + "/scenes/" + name + ".textproto";
}

std::string WriteTestFile(const std::string& name, const std::string& text) {
  const std::string path = testing::TempDir() + "tessera_worker_" + std::to_string(getpid()) + "_" + name;
  std::ofstream(path, std::ios::binary) << text;
  return path;
}

std::uint16_t FreeBasePort(std::uint32_t regions) {
  std::random_device random;
  for (int attempt = 0; attempt < 1000; ++attempt) {
    // Below the ports that the system chooses for others (32768 and up).
    const auto base = static_cast<std::uint16_t>(12'000 + random() % 20'000);
    bool free = true;
    for (std::uint32_t i = 0; free && i < 3 * regions; ++i) {
      const auto port = static_cast<std::uint16_t>(base + i);
      free = IsFree(port, SOCK_DGRAM) && IsFree(port, SOCK_STREAM);
    }
    if (free) return base;
  }
  ADD_FAILURE() << "no free ports";
  return 0;
}

std::string ReadMetrics(std::uint16_t port) {
  const auto answer = telemetry::HttpGet("127.0.0.1:" + std::to_string(port), "/metrics");
  if (!answer.ok() || answer->status != 200) {
    ADD_FAILURE() << (answer.ok() ? "status " + std::to_string(answer->status) : answer.status().ToString());
    return "";
  }
  return answer->body;
}

}  // namespace tessera::worker
