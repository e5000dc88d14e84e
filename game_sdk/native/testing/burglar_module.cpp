// A game for tests: a worker that was taken over. It runs whatever it likes in the worker's process, tries what an
// attacker would there, and logs a line for each try that got through, and one at the end.
#include <fcntl.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstring>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include "raw_grpc.h"
#include "tessera/game.hpp"

using namespace tessera::native;

namespace {

bool Opens(const std::string& path, int flags) {
  const int fd = open(path.c_str(), flags | O_CLOEXEC, 0600);
  if (fd >= 0) close(fd);
  return fd >= 0;
}

// The value of an option of the worker's own command line; empty: there is none.
std::string Option(const std::string& name) {
  std::ifstream file("/proc/self/cmdline", std::ios::binary);
  const std::string all{std::istreambuf_iterator<char>(file), {}};
  const std::string option = name + std::string(1, '\0');
  const std::size_t at = all.find(option);
  return at == std::string::npos ? "" : all.c_str() + at + option.size();
}

// How far other processes are looked for on both sides of this one's; and regions with their lives and processes, of
// which agents begin some in a row.
constexpr int kProcesses = 40, kSiblings = 3, kSiblingsProcesses = 25;
// As many connections as a process may have to its agent (agent/limits.h); the worker has one of them.
constexpr std::size_t kMoreConnections = 8;

// A field of a message of protobuf: a number, or bytes.
std::string Varint(unsigned long long value) {
  std::string bytes;
  for (; value >= 0x80; value >>= 7) bytes.push_back(static_cast<char>(0x80 | (value & 0x7f)));
  bytes.push_back(static_cast<char>(value));
  return bytes;
}
std::string Field(unsigned number, unsigned long long value) { return Varint(number << 3) + Varint(value); }
std::string Field(unsigned number, const std::string& bytes) {
  return Varint(number << 3 | 2) + Varint(bytes.size()) + bytes;
}

// The first words of a worker to its agent, WorkerMessage of worker_link.proto: a report with nothing but the identity.
std::string FirstWords(const std::string& instance, long long region, long long incarnation, pid_t pid) {
  const auto whole = [](long long value) { return static_cast<unsigned long long>(value); };
  return Field(
      1, Field(1, Field(1, instance) + Field(2, whole(region)) + Field(3, whole(incarnation)) + Field(4, whole(pid))));
}

enum class Answer { kNoSocket, kClosed, kAnswered };

// Sends the first bytes of HTTP/2 to the control plane's socket: the preface and an empty SETTINGS frame.
Answer AnswerAt(const std::string& path) {
  constexpr char kHello[] = "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n\0\0\0\4\0\0\0\0\0";
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path) return Answer::kNoSocket;
  std::memcpy(address.sun_path, path.data(), path.size());
  const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  Answer answer = Answer::kNoSocket;
  if (fd >= 0 && connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) {
    char byte = 0;
    (void)!send(fd, kHello, sizeof kHello - 1, MSG_NOSIGNAL);
    answer = recv(fd, &byte, 1, 0) == 1 ? Answer::kAnswered : Answer::kClosed;
  }
  if (fd >= 0) close(fd);
  return answer;
}

class Burglar {
 public:
  explicit Burglar(World& world) : world_(world) {}

  void Run() {
    const std::string agent = Option("--agent-socket");
    if (agent.empty() || agent[0] != '/') return world_.log("burglar found no agent");
    const std::string folder = agent.substr(0, agent.rfind('/'));
    Try("the host's identity", Opens(folder + "/host.json", O_RDONLY));
    Try("the list of workers", Opens(folder + "/workers.json", O_RDONLY));
    Try("states of other workers", Opens(folder + "/states", O_RDONLY | O_DIRECTORY));
    Try("a scene of its own", Opens(folder + "/scenes/burglar.pb", O_WRONLY | O_CREAT));
    Try("the password file", Opens("/etc/passwd", O_WRONLY | O_APPEND));
    Try("a file in /tmp", Opens("/tmp/tessera-burglar", O_WRONLY | O_CREAT));
    const Answer control = AnswerAt(folder.substr(0, folder.rfind('/')) + "/control/control.sock");
    if (control == Answer::kNoSocket) return world_.log("burglar found no control plane");
    Try("the control plane", control == Answer::kAnswered);
    TryProcess("the agent", getppid());
    for (int step = 1; step <= kProcesses; ++step) {
      TryProcess("a neighbour", getpid() + step);
      TryProcess("a neighbour", getpid() - step);
    }
    TryAgent(agent);
    for (int i = 0; i < 10; ++i) {
      const pid_t child = fork();
      if (child == 0) _exit(0);
      if (child > 0) waitpid(child, nullptr, 0);
      Try("a process of its own", child > 0);
    }
    TryMemory("20 GiB", std::size_t{20} << 30);  // a worker has 16 GiB at most, unless its agent is told otherwise
    TryMemory("all memory", std::size_t{1} << 42);
    world_.log("burglar tried " + std::to_string(tries_) + " got through " + std::to_string(through_));
  }

 private:
  void Try(const std::string& what, bool got_through) {
    ++tries_;
    if (!got_through) return;
    ++through_;
    world_.log("burglar got " + what);
  }
  void TryMemory(const std::string& what, std::size_t bytes) {
    void* const memory =
        mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    Try(what, memory != MAP_FAILED);
    if (memory != MAP_FAILED) munmap(memory, bytes);
  }
  // The agent's socket lets a worker in, so it is spoken to in the name of each sibling.
  void TryAgent(const std::string& path) {
    const std::string method = "/tessera.v1.WorkerLinkService/Attach", instance = Option("--instance");
    const long long region = std::stoll(Option("--region")), life = std::stoll(Option("--incarnation"));
    RawGrpc agent(path);
    for (int step = -kSiblings; step <= kSiblings; ++step) {
      if (step == 0 || region + step < 1) continue;
      for (int process = -kSiblingsProcesses; process <= kSiblingsProcesses; ++process) {
        if (process == 0) continue;
        const std::string lie = FirstWords(instance, region + step, life + step, getpid() + process);
        const RawGrpc::Answer answer = agent.Say(method, lie);
        if (answer == RawGrpc::Answer::kNone) return world_.log("burglar lost the agent");
        Try("the agent in a neighbour's name", answer == RawGrpc::Answer::kAnswered);
      }
    }
    std::vector<std::unique_ptr<RawGrpc>> more;
    while (more.size() < kMoreConnections) more.push_back(std::make_unique<RawGrpc>(path));
    const std::string own = FirstWords(instance, region, life, getpid());
    Try("one connection too many to the agent", more.back()->Say(method, own) != RawGrpc::Answer::kNone);
  }
  void TryProcess(const std::string& whose, pid_t pid) {
    if (pid <= 1) return;
    const std::string process = "/proc/" + std::to_string(pid);
    Try("a list of descriptors of " + whose, Opens(process + "/fd", O_RDONLY | O_DIRECTORY));
    TryDescriptors(whose, pid);
    Try("memory of " + whose, Opens(process + "/mem", O_RDONLY));
    Try("environment of " + whose, Opens(process + "/environ", O_RDONLY));
    char here = 0;
    const iovec mine = {&here, 1}, there = {&here, 1};
    Try("bytes of " + whose, process_vm_readv(pid, &mine, 1, &there, 1, 0) > 0);
    Try("a signal to " + whose, kill(pid, 0) == 0);
  }

  // Copies of its descriptors, sockets among them.
  void TryDescriptors(const std::string& whose, pid_t pid) {
    const long found = syscall(SYS_pidfd_open, pid, 0);
    if (found < 0) return;  // there is no such process, or it is not ours to name
    for (int descriptor = 0; descriptor < 32; ++descriptor) {
      const long copy = syscall(SYS_pidfd_getfd, found, descriptor, 0);
      if (copy >= 0) close(static_cast<int>(copy));
      Try("a descriptor of " + whose, copy >= 0);
    }
    close(static_cast<int>(found));
  }

  World& world_;
  int tries_ = 0, through_ = 0;
};

}  // namespace

TESSERA_GAME_MODULE(game) {
  game.on_tick([](World& world) {
    if (world.tick() == 30) Burglar(world).Run();
  });
}
