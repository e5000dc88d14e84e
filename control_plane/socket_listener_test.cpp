// The control plane's socket, as processes of its own user see it: those that have given up rights, and those that have
// not.
#include "control_plane/socket_listener.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>

#include "control_plane/restraint.h"
#include "host/temporary_folder.h"

namespace tessera::control {
namespace {

using ::testing::HasSubstr;

constexpr char kGreeting = 'g';

// A filter that forbids nothing: how much it forbids is not what counts.
bool AddFilter() {
  sock_filter allow = BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW);
  const sock_fprog program{.len = 1, .filter = &allow};
  return prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 && prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) == 0;
}

class SocketListenerTest : public ::testing::Test {
 protected:
  enum Heard : int { kLetIn = 0, kClosed = 1, kNoSocket = 2, kNotRestrained = 3 };

  SocketListenerTest() {
    auto listener = SocketListener::Listen(Path(), [](int fd) {
      (void)!write(fd, &kGreeting, 1);
      close(fd);
    });
    EXPECT_TRUE(listener.ok()) << listener.status();
    listener_ = *std::move(listener);
  }
  std::string Path() const { return folder_.path() + "/control.sock"; }
  // Whether a process gets in that has given up rights by `restrain`.
  int Dialled(const std::function<bool()>& restrain) const {
    const pid_t child = fork();
    if (child == 0) _exit(restrain() ? Dial() : kNotRestrained);
    int status = 0;
    waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

 private:
  int Dial() const {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    const std::string path = Path();
    std::copy(path.begin(), path.end(), address.sun_path);
    const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) return kNoSocket;
    char byte = 0;
    return read(fd, &byte, 1) == 1 && byte == kGreeting ? kLetIn : kClosed;
  }

  const host::TemporaryFolder folder_;
  std::unique_ptr<SocketListener> listener_;
};

TEST_F(SocketListenerTest, AProcessOfThisUserIsLetIn) {
  EXPECT_EQ(Dialled([] { return true; }), kLetIn);
}

TEST_F(SocketListenerTest, WhoHasOneMoreFilterThanThisProcessIsNot) {
  EXPECT_EQ(Dialled(AddFilter), kClosed);
  EXPECT_EQ(Dialled([] { return true; }), kLetIn) << "others are, as before";
}

TEST_F(SocketListenerTest, WhoHasNoNewPrivilegesIsNotUnlessThisProcessHasNoneEither) {
  const bool has_none = prctl(PR_GET_NO_NEW_PRIVS, 0, 0, 0, 0) == 1;
  EXPECT_EQ(Dialled([] { return prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0; }), has_none ? kLetIn : kClosed);
}

TEST_F(SocketListenerTest, TheSocketIsThisUsersAlone) {
  struct stat found {};
  ASSERT_EQ(stat(Path().c_str(), &found), 0);
  EXPECT_EQ(found.st_mode & 0777, 0600U);
}

TEST(RestraintTest, IsReadFromWhatTheKernelSays) {
  const auto worker = ParseRestraint("Name:\ttessera-region\nNoNewPrivs:\t1\nSeccomp:\t2\nSeccomp_filters:\t3\n");
  ASSERT_TRUE(worker.ok()) << worker.status();
  EXPECT_TRUE(worker->no_new_privileges);
  EXPECT_EQ(worker->filters, 3);
  const auto old_kernel = ParseRestraint("NoNewPrivs:\t0\nSeccomp:\t2\n");
  ASSERT_TRUE(old_kernel.ok()) << old_kernel.status();
  EXPECT_FALSE(old_kernel->no_new_privileges);
  EXPECT_EQ(old_kernel->filters, 2);
  EXPECT_EQ(ParseRestraint("NoNewPrivs:\t1\n").status().code(), absl::StatusCode::kUnimplemented);
  EXPECT_EQ(ParseRestraint("Name:\tNoNewPrivs:\t1\n").status().code(), absl::StatusCode::kUnimplemented);
}

TEST(RestraintTest, WhoCannotBeLookedAtIsNotTakenForUnrestrained) {
  EXPECT_THAT(std::string(RestraintOf(0).status().message()), HasSubstr("namespace"));
  const pid_t child = fork();
  if (child == 0) _exit(0);
  waitpid(child, nullptr, 0);
  EXPECT_EQ(RestraintOf(child).status().code(), absl::StatusCode::kUnavailable);
}

}  // namespace
}  // namespace tessera::control
