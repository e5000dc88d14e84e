// A game for tests: a worker that was taken over. It runs whatever it likes in the worker's process, tries what an
// attacker would there, and logs a line for each try that got through, and one at the end.
#include <fcntl.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/uio.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstring>
#include <fstream>
#include <iterator>
#include <string>

#include "tessera/game.hpp"

using namespace tessera::native;

namespace {

bool Opens(const std::string& path, int flags) {
  const int fd = open(path.c_str(), flags | O_CLOEXEC, 0600);
  if (fd >= 0) close(fd);
  return fd >= 0;
}

// The agent's folder, from the worker's own command line.
std::string AgentFolder() {
  std::ifstream file("/proc/self/cmdline", std::ios::binary);
  const std::string all{std::istreambuf_iterator<char>(file), {}};
  const std::string option("--agent-socket\0", 15);
  const std::size_t at = all.find(option);
  if (at == std::string::npos) return "";
  const std::string socket = all.c_str() + at + option.size();
  return socket.substr(0, socket.rfind('/'));
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
    const std::string folder = AgentFolder();
    if (folder.empty() || folder[0] != '/') return world_.log("burglar found no agent");
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
    for (int step = 1; step <= 40; ++step) {
      TryProcess("a neighbour", getpid() + step);
      TryProcess("a neighbour", getpid() - step);
    }
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
  void TryProcess(const std::string& whose, pid_t pid) {
    if (pid <= 1) return;
    const std::string process = "/proc/" + std::to_string(pid);
    Try("memory of " + whose, Opens(process + "/mem", O_RDONLY));
    Try("environment of " + whose, Opens(process + "/environ", O_RDONLY));
    char here = 0;
    const iovec mine = {&here, 1}, there = {&here, 1};
    Try("bytes of " + whose, process_vm_readv(pid, &mine, 1, &there, 1, 0) > 0);
    Try("a signal to " + whose, kill(pid, 0) == 0);
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
