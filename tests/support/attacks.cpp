#include "tests/support/attacks.h"

#include <fmt/format.h>
#include <grpcpp/grpcpp.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <string_view>

#include "tessera/v1/host.grpc.pb.h"
#include "tests/support/attack_calls.h"

namespace tessera::support {

double OperatorsCallSeconds(const Target& target) {
  v1::ListHostsResponse response;
  grpc::ClientContext context;
  context.set_deadline(Soon());
  const auto stub = v1::HostService::NewStub(DialAlone(target.socket));
  const auto begin = std::chrono::steady_clock::now();
  if (!stub->ListHosts(&context, {}, &response).ok()) return -1;
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

double ResidentMegabytes(pid_t pid) {
  std::ifstream file(fmt::format("/proc/{}/statm", pid));
  std::uint64_t whole = 0, resident = 0;
  file >> whole >> resident;
  return static_cast<double>(resident) * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e6;
}

bool ForgetHighest(pid_t pid) {
  std::ofstream file(fmt::format("/proc/{}/clear_refs", pid));
  file << "5" << std::flush;
  return file.good();
}

double HighestMegabytes(pid_t pid) {
  std::ifstream file(fmt::format("/proc/{}/status", pid));
  for (std::string line; std::getline(file, line);) {
    constexpr std::string_view kName = "VmHWM:";
    if (line.starts_with(kName)) return std::stod(line.substr(kName.size())) * 1024 / 1e6;
  }
  return 0;
}

}  // namespace tessera::support
