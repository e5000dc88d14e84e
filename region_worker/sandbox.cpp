#include "region_worker/sandbox.h"

#include <fcntl.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <fstream>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "host/landlock.h"

namespace tessera::worker {
namespace {

// A sanitizer's runtime makes a process that traces this one to look for leaks, starts a program that names a fault's
// lines, and reserves terabytes.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kSanitized = true;
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
constexpr bool kSanitized = true;
#else
constexpr bool kSanitized = false;
#endif
#else
constexpr bool kSanitized = false;
#endif

// The kernel kills the process with the highest sum of its share of memory, in thousandths, and this number.
constexpr int kOutOfMemoryScore = 300;

// --- Files: Landlock (landlock(7)). Its constants are here, since the headers of a distribution know an older
// kernel's.

constexpr std::uint64_t kExecute = 1U << 0, kWriteFile = 1U << 1, kReadFile = 1U << 2, kReadFolder = 1U << 3,
                        kRemoveFolder = 1U << 4, kRemoveFile = 1U << 5, kMakeFile = 1U << 8, kRefer = 1U << 13,
                        kTruncate = 1U << 14, kFirstVersionRights = (1U << 13) - 1;
constexpr std::uint64_t kScopeAbstractSockets = 1U << 0, kScopeSignals = 1U << 1;
constexpr std::uint64_t kRead = kReadFile | kReadFolder;
constexpr std::uint64_t kAppend = kWriteFile | kRemoveFile | kMakeFile | kTruncate;
constexpr std::uint64_t kFileRights = kExecute | kWriteFile | kReadFile | kTruncate;  // those that a file can have
constexpr int kRuleBeneath = 1;

struct LandlockRights {
  std::uint64_t files = 0, network = 0, scoped = 0;
};
struct [[gnu::packed]] LandlockBeneath {
  std::uint64_t allowed = 0;
  std::int32_t folder = -1;
};

// Where the loader, the resolver, time zones, gRPC, our own figures and whoever prints a stack read. The two names that
// are links elsewhere on some machines stand for what they lead to. Files that only root may read stay shut as always.
constexpr std::array kSystemFiles = {"/usr",
                                     "/lib",
                                     "/lib64",
                                     "/etc",
                                     "/etc/resolv.conf",
                                     "/etc/localtime",
                                     "/run/systemd/resolve",
                                     "/sys/devices/system",
                                     "/sys/fs/cgroup",
                                     "/proc/stat",
                                     "/proc/meminfo",
                                     "/proc/cpuinfo",
                                     "/proc/pressure",
                                     "/proc/self/exe",
                                     "/proc/sys",
                                     "/dev/urandom",
                                     "/dev/random",
                                     "/dev/zero"};

class Landlock {
 public:
  explicit Landlock(int version)
      : handled_(kFirstVersionRights | (version >= 2 ? kRefer : 0) | (version >= 3 ? kTruncate : 0)) {
    LandlockRights rights{.files = handled_};
    if (version >= 6) rights.scoped = kScopeAbstractSockets | kScopeSignals;
    const std::size_t size = version >= 6 ? sizeof rights : sizeof rights.files;
    ruleset_ = static_cast<int>(syscall(SYS_landlock_create_ruleset, &rights, size, 0U));
    error_ = ruleset_ < 0 ? errno : 0;
  }
  ~Landlock() {
    if (ruleset_ >= 0) close(ruleset_);
  }
  Landlock(const Landlock&) = delete;
  Landlock& operator=(const Landlock&) = delete;

  // 0, or errno.
  int Allow(const std::string& path, std::uint64_t rights) {
    if (error_ != 0) return error_;
    const int place = open(path.c_str(), O_PATH | O_CLOEXEC);
    if (place < 0) return errno;
    if (const int folder = open(path.c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC); folder >= 0) {
      close(folder);
    } else {
      rights &= kFileRights;
    }
    const LandlockBeneath rule{.allowed = rights & handled_, .folder = place};
    const int error = syscall(SYS_landlock_add_rule, ruleset_, kRuleBeneath, &rule, 0U) == 0 ? 0 : errno;
    // When memory is short, the kernel forgets an entry of /proc that nobody has open, and makes it anew, without the
    // rule, when it is next looked for. So these stay open for as long as the process lives.
    if (!path.starts_with("/proc/")) close(place);
    return error;
  }
  int Enter() const {
    if (error_ != 0) return error_;
    return syscall(SYS_landlock_restrict_self, ruleset_, 0U) == 0 ? 0 : errno;
  }

 private:
  std::uint64_t handled_;
  int ruleset_ = -1, error_ = 0;
};

absl::Status AllowFiles(Landlock& landlock, const SandboxSpec& spec) {
  for (const char* path : kSystemFiles) landlock.Allow(path, kSanitized ? kRead | kExecute : kRead);
  for (const std::string& path : spec.readable) landlock.Allow(path, kRead);
  landlock.Allow("/dev/null", kReadFile | kWriteFile);
  landlock.Allow("/proc/self", kRead | kWriteFile | kTruncate);  // this process's, whoever asks
  for (const std::string& path : spec.writable) {
    if (const int error = landlock.Allow(path, kRead | kAppend | kRemoveFolder); error != 0) {
      return absl::InvalidArgumentError(absl::StrCat(path, ": ", std::strerror(error)));
    }
  }
  for (const std::string& path : spec.append) {
    if (const int error = landlock.Allow(path, kAppend); error != 0) {
      return absl::InvalidArgumentError(absl::StrCat(path, ": ", std::strerror(error)));
    }
  }
  return absl::OkStatus();
}

// --- Processes: seccomp (seccomp(2))

#if defined(__x86_64__)
constexpr std::uint32_t kArchitecture = AUDIT_ARCH_X86_64;
#elif defined(__aarch64__)
constexpr std::uint32_t kArchitecture = AUDIT_ARCH_AARCH64;
#else
#error "seccomp's name of this processor is needed here"
#endif
constexpr std::uint32_t kOtherTableBit = 0x40000000;  // system calls of x32
constexpr std::uint32_t kCloneThread = CLONE_THREAD;

// Never needed by a worker: other programs and processes, memory that does not count as its address space, and parts of
// the kernel where faults were found before.
constexpr std::array kRefused = {
    SYS_execve,
    SYS_execveat,
    SYS_ptrace,
    SYS_process_vm_readv,
    SYS_process_vm_writev,
    SYS_kcmp,
    SYS_unshare,
    SYS_setns,
    SYS_mount,
    SYS_umount2,
    SYS_pivot_root,
    SYS_chroot,
    SYS_bpf,
    SYS_perf_event_open,
    SYS_add_key,
    SYS_request_key,
    SYS_keyctl,
    SYS_userfaultfd,
    SYS_init_module,
    SYS_finit_module,
    SYS_delete_module,
    SYS_kexec_load,
    SYS_reboot,
    SYS_swapon,
    SYS_swapoff,
    SYS_acct,
    SYS_io_uring_setup,
    SYS_pidfd_getfd,
    SYS_pidfd_send_signal,
    SYS_process_madvise,
    SYS_open_by_handle_at,
    SYS_tkill,
    SYS_memfd_create,
    SYS_shmget,
    SYS_msgget,
    SYS_mq_open,
#ifdef SYS_fork
    SYS_fork,
    SYS_vfork,
#endif
};
// Their first argument is a process: this one, or 0, which is this one or its own group.
constexpr std::array kOnlyOfItself = {SYS_kill, SYS_tgkill, SYS_prlimit64, SYS_rt_sigqueueinfo, SYS_rt_tgsigqueueinfo};

class Filter {
 public:
  Filter() {
    Load(offsetof(seccomp_data, arch));
    SkipIfEqual(kArchitecture, 1);
    Refuse(EPERM);
    Load(offsetof(seccomp_data, nr));
    program_.push_back(BPF_JUMP(BPF_JMP | BPF_JGE | BPF_K, kOtherTableBit, 0, 1));
    Refuse(EPERM);
    for (const long call : kRefused) {
      SkipUnlessEqual(call, 1);
      Refuse(EPERM);
    }
    // Its flags lie in memory, where no filter can see them; libraries then use clone.
    SkipUnlessEqual(SYS_clone3, 1);
    Refuse(ENOSYS);
    SkipUnlessEqual(SYS_clone, 4);
    Load(offsetof(seccomp_data, args));
    program_.push_back(BPF_JUMP(BPF_JMP | BPF_JSET | BPF_K, kCloneThread, 1, 0));
    Refuse(EPERM);
    Allow();
    for (const long call : kOnlyOfItself) {
      SkipUnlessEqual(call, 5);
      Load(offsetof(seccomp_data, args));
      SkipIfEqual(static_cast<std::uint32_t>(getpid()), 2);
      SkipIfEqual(0, 1);
      Refuse(EPERM);
      Allow();
    }
    Allow();
  }
  // 0, or errno.
  int Enter() {
    const sock_fprog program{.len = static_cast<unsigned short>(program_.size()), .filter = program_.data()};
    return prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) == 0 ? 0 : errno;
  }

 private:
  // All arguments that are looked at have 32 bits; both processors are little-endian, so their low halves come first.
  void Load(std::size_t offset) {
    program_.push_back(BPF_STMT(BPF_LD | BPF_W | BPF_ABS, static_cast<std::uint32_t>(offset)));
  }
  void SkipIfEqual(std::uint32_t value, std::uint8_t steps) {
    program_.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, value, steps, 0));
  }
  void SkipUnlessEqual(long value, std::uint8_t steps) {
    program_.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, static_cast<std::uint32_t>(value), 0, steps));
  }
  void Refuse(int error) {
    program_.push_back(BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | static_cast<std::uint32_t>(error)));
  }
  void Allow() { program_.push_back(BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW)); }

  std::vector<sock_filter> program_;
};

absl::Status Internal(const char* what, int error) {
  return absl::InternalError(absl::StrCat(what, ": ", std::strerror(error)));
}

absl::Status LimitMemory(std::uint64_t bytes) {
  std::ofstream("/proc/self/oom_score_adj") << kOutOfMemoryScore;  // refused where somebody has set a higher one
  if (bytes == 0 || kSanitized) return absl::OkStatus();
  const rlimit limit{.rlim_cur = bytes, .rlim_max = bytes};
  return setrlimit(RLIMIT_AS, &limit) == 0 ? absl::OkStatus() : Internal("setrlimit", errno);
}

}  // namespace

absl::StatusOr<std::string> EnterSandbox(const SandboxSpec& spec) {
  if (absl::Status status = LimitMemory(spec.memory_bytes); !status.ok()) return status;
  if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) return Internal("no_new_privs", errno);
  std::string missing;
  const absl::StatusOr<int> version = host::LandlockVersion();
  if (!version.ok()) {
    missing = std::string(version.status().message());
    // The next best: nobody but root reads this process's memory. Not where /proc hides what cannot be traced, since an
    // agent could not find its workers again.
    if (access("/proc/1/stat", R_OK) == 0) prctl(PR_SET_DUMPABLE, 0, 0, 0, 0);
  } else {
    Landlock landlock(*version);
    if (absl::Status status = AllowFiles(landlock, spec); !status.ok()) return status;
    if (const int error = landlock.Enter(); error != 0) return Internal("Landlock", error);
  }
  if (kSanitized) return missing;
  if (const int error = Filter().Enter(); error == EINVAL) {
    absl::StrAppend(&missing, missing.empty() ? "" : "; ", "seccomp: ", std::strerror(error));
  } else if (error != 0) {
    return Internal("seccomp", error);
  }
  return missing;
}

}  // namespace tessera::worker
