// A worker that was taken over, as the machine sees it: a process in the sandbox that tries what it must not.
#include "region_worker/sandbox.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/ipc.h>
#include <sys/mman.h>
#include <sys/msg.h>
#include <sys/prctl.h>
#include <sys/ptrace.h>
#include <sys/resource.h>
#include <sys/shm.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <thread>

#include "host/landlock.h"
#include "host/temporary_folder.h"
#include "host/testing/hide_landlock.h"

namespace tessera::worker {
namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kSandboxTestSanitized = true;
#else
constexpr bool kSandboxTestSanitized = false;
#endif

// Expects that `refused` is true; in the child, where no assertion of the test's framework reaches anybody.
struct Attempts {
  int got_through = 0;
  void Refused(const char* what, bool refused) {
    if (refused) return;
    ++got_through;
    std::fprintf(stderr, "got through: %s (%s)\n", what, std::strerror(errno));
  }
};

class SandboxTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (const auto version = host::LandlockVersion(); !version.ok()) GTEST_SKIP() << version.status().message();
    for (const char* name : {"readable", "writable", "logs"}) std::filesystem::create_directory(Path(name));
    std::ofstream(Path("readable/scene")) << "scene";
    std::ofstream(Path("logs/other.log")) << "log";
    std::ofstream(Path("host.json")) << "secret";
  }
  std::string Path(const std::string& name) const { return folder_.path() + "/" + name; }
  SandboxSpec Spec() const {
    return {.readable = {Path("readable"), Path("absent")}, .writable = {Path("writable")}, .append = {Path("logs")}};
  }
  // How many attempts got through, of a process in the sandbox. 100: it could not be entered.
  static int Inside(const SandboxSpec& spec, const std::function<void(Attempts&)>& attack) {
    const pid_t child = fork();
    if (child == 0) {
      const auto missing = EnterSandbox(spec);
      if (!missing.ok() || !missing->empty()) {
        std::fprintf(stderr, "%s\n", missing.ok() ? missing->c_str() : missing.status().ToString().c_str());
        _exit(100);
      }
      Attempts attempts;
      attack(attempts);
      _exit(attempts.got_through);
    }
    int status = 0;
    EXPECT_EQ(waitpid(child, &status, 0), child);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }
  static bool Opens(const std::string& path, int flags) {
    const int fd = open(path.c_str(), flags | O_CLOEXEC, 0600);
    if (fd >= 0) close(fd);
    return fd >= 0;
  }

  const host::TemporaryFolder folder_;
};

TEST_F(SandboxTest, FilesThatAWorkerHasNoPartInStayShut) {
  EXPECT_EQ(Inside(Spec(),
                   [this](Attempts& a) {
                     a.Refused("host.json", !Opens(Path("host.json"), O_RDONLY));
                     a.Refused("host.json by another way", !Opens(Path("readable/../host.json"), O_RDONLY));
                     a.Refused("list the agent's folder", !Opens(folder_.path(), O_RDONLY | O_DIRECTORY));
                     a.Refused("read another's log", !Opens(Path("logs/other.log"), O_RDONLY));
                     a.Refused("change a scene", !Opens(Path("readable/scene"), O_WRONLY));
                     a.Refused("make a file", !Opens(Path("new"), O_WRONLY | O_CREAT));
                     a.Refused("remove host.json", unlink(Path("host.json").c_str()) != 0);
                     a.Refused("link host.json", link(Path("host.json").c_str(), Path("writable/link").c_str()) != 0);
                     a.Refused("run it by a link", symlink(Path("host.json").c_str(), Path("writable/s").c_str()) != 0);
                   }),
            0);
}

TEST_F(SandboxTest, AWorkersOwnFilesAndThreadsAreAsBefore) {
  EXPECT_EQ(Inside(Spec(),
                   [this](Attempts& a) {
                     // Refused() counts what is false, so here each says what must work.
                     a.Refused("read a scene", Opens(Path("readable/scene"), O_RDONLY));
                     a.Refused("write a checkpoint", Opens(Path("writable/1.checkpoint.new"), O_RDWR | O_CREAT));
                     a.Refused("name it", rename(Path("writable/1.checkpoint.new").c_str(),
                                                 Path("writable/1.checkpoint").c_str()) == 0);
                     a.Refused("write a log", Opens(Path("logs/own.log"), O_WRONLY | O_CREAT | O_APPEND));
                     a.Refused("rotate it", rename(Path("logs/own.log").c_str(), Path("logs/own.log.1").c_str()) == 0);
                     a.Refused("read its own figures", Opens("/proc/self/stat", O_RDONLY));
                     a.Refused("read its memory", Opens("/proc/self/statm", O_RDONLY));
                     a.Refused("load a library", Opens("/etc/ld.so.cache", O_RDONLY));
                     a.Refused("find the names of its stack", Opens("/proc/self/exe", O_RDONLY));
                     a.Refused("read the time zone", access("/etc/localtime", F_OK) != 0 || Opens("/etc/localtime", 0));
                     a.Refused("resolve", access("/etc/resolv.conf", F_OK) != 0 || Opens("/etc/resolv.conf", O_RDONLY));
                     // A kernel may have the file and refuse to fill it; who asks is then told so at the opening.
                     a.Refused("read what it waits for", Opens("/proc/pressure/cpu", O_RDONLY) || errno != EACCES);
                     a.Refused("give itself a share", Opens("/proc/self/autogroup", O_WRONLY) || errno != EACCES);
                     bool ran = false;
                     std::thread([&ran] { ran = true; }).join();
                     a.Refused("start a thread", ran);
                     a.Refused("signal itself", raise(0) == 0 && kill(getpid(), 0) == 0);
                   }),
            0);
}

TEST_F(SandboxTest, OtherProcessesAreNeitherMadeNorReached) {
  if (kSandboxTestSanitized) GTEST_SKIP() << "a sanitizer makes processes of its own";
  // A sibling, as another worker of the host is: same user, in a sandbox as well.
  const pid_t sibling = fork();
  if (sibling == 0) {
    (void)EnterSandbox(Spec());
    for (;;) pause();
  }
  char secret[] = "sibling's";
  EXPECT_EQ(Inside(Spec(),
                   [&](Attempts& a) {
                     char read[sizeof secret];
                     const iovec mine{.iov_base = read, .iov_len = sizeof read};
                     const iovec other{.iov_base = secret, .iov_len = sizeof secret};
                     a.Refused("fork", fork() < 0);
                     a.Refused("vfork by its number", syscall(SYS_clone, SIGCHLD, 0, 0, 0, 0) < 0);
                     a.Refused("clone3", syscall(SYS_clone3, nullptr, 0) < 0 && errno == ENOSYS);
                     char* const argv[] = {const_cast<char*>("true"), nullptr};
                     a.Refused("exec", execve("/usr/bin/true", argv, argv + 1) != 0);
                     a.Refused("process_vm_readv", process_vm_readv(sibling, &mine, 1, &other, 1, 0) < 0);
                     a.Refused("ptrace", ptrace(PTRACE_SEIZE, sibling, nullptr, nullptr) != 0);
                     const std::string proc = "/proc/" + std::to_string(sibling);
                     a.Refused("memory by /proc", !Opens(proc + "/mem", O_RDONLY));
                     a.Refused("environment by /proc", !Opens(proc + "/environ", O_RDONLY));
                     a.Refused("kill", kill(sibling, SIGKILL) != 0);
                     a.Refused("kill the agent", kill(getppid(), SIGCONT) != 0);
                     rlimit none{};
                     a.Refused("limit another", prlimit(sibling, RLIMIT_NOFILE, &none, nullptr) != 0);
                     const int pidfd = static_cast<int>(syscall(SYS_pidfd_open, sibling, 0));
                     a.Refused("take a descriptor", syscall(SYS_pidfd_getfd, pidfd, 0, 0) < 0);
                     a.Refused("kill by pidfd", syscall(SYS_pidfd_send_signal, pidfd, SIGKILL, nullptr, 0) != 0);
                   }),
            0);
  EXPECT_EQ(kill(sibling, SIGKILL), 0) << "it still lives";
  waitpid(sibling, nullptr, 0);
}

TEST_F(SandboxTest, MemoryHasAnEnd) {
  if (kSandboxTestSanitized) GTEST_SKIP() << "a sanitizer reserves terabytes";
  SandboxSpec spec = Spec();
  spec.memory_bytes = std::uint64_t{1} << 30;
  EXPECT_EQ(Inside(spec,
                   [](Attempts& a) {
                     const auto map = [](std::size_t bytes, int how) {
                       return mmap(nullptr, bytes, PROT_READ | PROT_WRITE, how | MAP_ANONYMOUS, -1, 0) != MAP_FAILED;
                     };
                     a.Refused("20 GB", !map(std::size_t{20} << 30, MAP_PRIVATE));
                     a.Refused("20 GB shared", !map(std::size_t{20} << 30, MAP_SHARED));
                     int pieces = 0;
                     while (pieces < 64 && map(std::size_t{64} << 20, MAP_PRIVATE)) ++pieces;
                     a.Refused("4 GB in pieces", pieces < 16);
                     a.Refused("a file in memory", memfd_create("memory", 0) < 0);
                     a.Refused("memory that has a key",
                               shmget(IPC_PRIVATE, std::size_t{1} << 20, IPC_CREAT | 0600) < 0);
                     a.Refused("a queue of the kernel", msgget(IPC_PRIVATE, IPC_CREAT | 0600) < 0);
                     const rlimit more{.rlim_cur = RLIM_INFINITY, .rlim_max = RLIM_INFINITY};
                     // Root may raise a limit; a worker's user may not.
                     if (geteuid() != 0) a.Refused("raise the limit", setrlimit(RLIMIT_AS, &more) != 0);
                   }),
            0);
}

TEST(SandboxWithoutLandlockTest, TheRestIsGivenUpAndTheAnswerNamesWhatIsMissing) {
  const host::TemporaryFolder folder;
  const pid_t child = fork();
  if (child == 0) {
    if (!host::HideLandlock()) _exit(100);
    SandboxSpec spec;
    spec.writable = {folder.path()};
    const auto missing = EnterSandbox(spec);
    if (!missing.ok() || *missing != "Landlock: Function not implemented") _exit(101);
    Attempts a;
    a.Refused("still write", open((folder.path() + "/state").c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600) >= 0);
    if (!kSandboxTestSanitized) {
      a.Refused("fork", fork() < 0);
      a.Refused("be read by a process of its user", prctl(PR_GET_DUMPABLE) == 0);
    }
    _exit(a.got_through);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

TEST_F(SandboxTest, AFolderThatIsNotThereIsNamed) {
  SandboxSpec spec = Spec();
  spec.writable.push_back(Path("nowhere"));
  const pid_t child = fork();
  if (child == 0) {
    const auto missing = EnterSandbox(spec);
    _exit(missing.status().message().find("/nowhere: No such file") != std::string_view::npos ? 0 : 1);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
}

}  // namespace
}  // namespace tessera::worker
