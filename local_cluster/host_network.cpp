#include "local_cluster/host_network.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sched.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>

#include "absl/strings/str_cat.h"
#include "host/child_process.h"
#include "host/last_lines.h"
#include "host/temporary_folder.h"

namespace tessera::local {
namespace {

constexpr char kIp[] = "/usr/sbin/ip", kNsenter[] = "/usr/bin/nsenter";
constexpr char kSwitch[] = "tessera";
constexpr std::chrono::seconds kPatience{10};

absl::Status Unavailable(const std::string& what) {
  return absl::UnavailableError(absl::StrCat(what, ": ", std::strerror(errno)));
}

// UNAVAILABLE with what it said, unless it ends with 0.
absl::Status Run(const std::vector<std::string>& argv) {
  const host::TemporaryFolder folder;
  const std::string log = folder.path() + "/log";
  auto process = host::ChildProcess::Start({.argv = argv, .log_path = log});
  if (!process.ok()) return process.status();
  const auto ended = process->Wait(kPatience);
  if (ended && ended->Clean()) return absl::OkStatus();
  return absl::UnavailableError(fmt::format("{}{}", fmt::join(argv, " "), host::LastLinesText(log, 3)));
}

std::string PortOf(std::uint32_t host) { return fmt::format("host{}", host + 1); }

}  // namespace

absl::Status EnterOwnNetwork() {
  const uid_t user = geteuid();
  const gid_t group = getegid();
  if (unshare(user == 0 ? CLONE_NEWNET : CLONE_NEWUSER | CLONE_NEWNET) != 0) return Unavailable("unshare");
  if (user != 0) {  // root in there, this user outside: files stay this user's
    std::ofstream("/proc/self/setgroups") << "deny";
    std::ofstream("/proc/self/uid_map") << fmt::format("0 {} 1", user);
    std::ofstream("/proc/self/gid_map") << fmt::format("0 {} 1", group);
  }
  return Run({kIp, "link", "set", "lo", "up"});
}

absl::StatusOr<std::unique_ptr<HostNetwork>> HostNetwork::Create(std::uint32_t hosts) {
  std::unique_ptr<HostNetwork> network(new HostNetwork);
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{kIp, "link", "add", kSwitch, "type", "bridge"},
        std::vector<std::string>{kIp, "address", "add", network->switch_address_ + "/24", "dev", kSwitch},
        std::vector<std::string>{kIp, "link", "set", kSwitch, "up"}}) {
    if (absl::Status status = Run(command); !status.ok()) return status;
  }
  for (std::uint32_t host = 0; host < hosts; ++host) {
    if (absl::Status status = network->Add(host); !status.ok()) return status;
  }
  return network;
}

HostNetwork::~HostNetwork() {
  for (std::uint32_t host = 0; host < namespaces_.size(); ++host) {
    (void)Run({kIp, "link", "delete", PortOf(host)});
    close(namespaces_[host]);
  }
  (void)Run({kIp, "link", "delete", kSwitch});
}

absl::Status HostNetwork::Add(std::uint32_t host) {
  // Only this thread enters it, for a moment: the namespace lives on by its descriptor.
  const int own = open("/proc/thread-self/ns/net", O_RDONLY | O_CLOEXEC);
  if (own < 0) return Unavailable("/proc/thread-self/ns/net");
  const bool made = unshare(CLONE_NEWNET) == 0;
  const int there = made ? open("/proc/thread-self/ns/net", O_RDONLY | O_CLOEXEC) : -1;
  const bool back = !made || setns(own, CLONE_NEWNET) == 0;
  close(own);
  if (there < 0 || !back) return Unavailable("cannot make a network namespace");
  namespaces_.push_back(there);
  const std::string port = PortOf(host), name = fmt::format("/proc/{}/fd/{}", getpid(), there);
  const auto inside = [&](std::vector<std::string> command) {
    std::vector<std::string> argv = Enter(host);
    argv.insert(argv.end(), command.begin(), command.end());
    return Run(argv);
  };
  absl::Status status = Run({kIp, "link", "add", port, "type", "veth", "peer", "name", "eth0", "netns", name});
  if (status.ok()) status = Run({kIp, "link", "set", port, "master", kSwitch, "up"});
  if (status.ok()) status = inside({kIp, "link", "set", "lo", "up"});
  if (status.ok()) status = inside({kIp, "address", "add", address(host) + "/24", "dev", "eth0"});
  if (status.ok()) status = inside({kIp, "link", "set", "eth0", "up"});
  return status;
}

std::string HostNetwork::address(std::uint32_t host) const { return fmt::format("10.77.0.{}", host + 11); }

std::vector<std::string> HostNetwork::Enter(std::uint32_t host) const {
  return {kNsenter, fmt::format("--net=/proc/{}/fd/{}", getpid(), namespaces_.at(host)), "--"};
}

// By a wrong neighbour: packets go to an address of the wire that nobody has, and senders hear of no error, as in a
// network that loses them.
absl::Status HostNetwork::Lose(std::uint32_t from, std::uint32_t to) const {
  std::vector<std::string> argv = Enter(from);
  argv.insert(argv.end(), {kIp, "neighbour", "replace", address(to), "lladdr", "02:00:00:00:00:01", "dev", "eth0",
                           "nud", "permanent"});
  return Run(argv);
}

absl::Status HostNetwork::Find(std::uint32_t from, std::uint32_t to) const {
  std::vector<std::string> argv = Enter(from);
  argv.insert(argv.end(), {kIp, "neighbour", "del", address(to), "dev", "eth0"});
  return Run(argv);
}

absl::Status HostNetwork::EnterThread(std::uint32_t host) const {
  return setns(namespaces_.at(host), CLONE_NEWNET) == 0 ? absl::OkStatus() : Unavailable("setns");
}

absl::Status HostNetwork::Cut(std::uint32_t host) const { return Run({kIp, "link", "set", PortOf(host), "down"}); }
absl::Status HostNetwork::Mend(std::uint32_t host) const { return Run({kIp, "link", "set", PortOf(host), "up"}); }

}  // namespace tessera::local
