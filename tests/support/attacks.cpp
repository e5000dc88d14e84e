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

namespace {

double ListHostsSeconds(const std::string& address, const trust::Credentials& credentials) {
  v1::ListHostsResponse response;
  grpc::ClientContext context;
  context.set_deadline(Soon());
  const auto stub = v1::HostService::NewStub(DialAlone(address, credentials));
  const auto begin = std::chrono::steady_clock::now();
  if (!stub->ListHosts(&context, {}, &response).ok()) return -1;
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

// A line of a file in /proc that gives kilobytes: "VmHWM:     1234 kB". 0: there is none.
double MegabytesIn(const std::string& path, std::string_view name) {
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with(name)) return std::stod(line.substr(name.size())) * 1024 / 1e6;
  }
  return 0;
}

}  // namespace

double OperatorsCallSeconds(const Target& target) { return ListHostsSeconds(target.socket, {}); }

double OperatorsCallSecondsAtDoor(const Target& target, const std::string& token) {
  return ListHostsSeconds(target.operators, {.authority = {}, .certificate = {}, .key = {}, .bearer_token = token});
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

double HighestMegabytes(pid_t pid) { return MegabytesIn(fmt::format("/proc/{}/status", pid), "VmHWM:"); }

double AnonymousMegabytes(pid_t pid) { return MegabytesIn(fmt::format("/proc/{}/smaps_rollup", pid), "Anonymous:"); }

}  // namespace tessera::support
