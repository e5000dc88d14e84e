#include "agent/peer_listener.h"

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <condition_variable>
#include <csignal>
#include <string>
#include <vector>

#include "agent/limits.h"
#include "host/temporary_folder.h"

namespace tessera::agent {
namespace {

int DialPeerSocket(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::copy(path.begin(), path.end(), address.sun_path);
  const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  return connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 ? fd : -1;
}

// Whether the other side has closed it; waits for that.
bool IsClosedByPeer(int fd) {
  pollfd watch{.fd = fd, .events = POLLIN, .revents = 0};
  char byte = 0;
  return poll(&watch, 1, 60'000) == 1 && recv(fd, &byte, 1, MSG_DONTWAIT) <= 0;
}

class PeerListenerTest : public ::testing::Test {
 protected:
  void SetUp() override {
    auto listener = PeerListener::Listen(Path(), [this](int fd) {
      const std::lock_guard lock(mutex_);
      taken_.push_back(fd);
      came_.notify_all();
    });
    ASSERT_TRUE(listener.ok()) << listener.status();
    listener_ = *std::move(listener);
  }
  void TearDown() override {
    listener_.reset();
    for (const int fd : taken_) close(fd);
  }
  std::string Path() const { return folder_.path() + "/agent.sock"; }
  // The `count`th connection that was handed out.
  int Taken(std::size_t count) {
    std::unique_lock lock(mutex_);
    EXPECT_TRUE(came_.wait_for(lock, std::chrono::seconds(60), [&] { return taken_.size() >= count; }));
    return taken_.at(count - 1);
  }

  const host::TemporaryFolder folder_;
  std::unique_ptr<PeerListener> listener_;
  std::mutex mutex_;
  std::condition_variable came_;
  std::vector<int> taken_;
};

TEST_F(PeerListenerTest, KnowsTheProcessThatDialledWhateverItSays) {
  const int mine = DialPeerSocket(Path());
  EXPECT_EQ(listener_->PeerOf(Taken(1)), getpid());
  const pid_t child = fork();
  if (child == 0) {
    (void)!write(DialPeerSocket(Path()), "pid 1", 5);
    for (;;) pause();
  }
  EXPECT_EQ(listener_->PeerOf(Taken(2)), child);
  EXPECT_EQ(listener_->PeerOf(Taken(2) + 1), 0);
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  close(mine);
}

TEST_F(PeerListenerTest, TheSocketIsThisUsersAlone) {
  struct stat found {};
  ASSERT_EQ(stat(Path().c_str(), &found), 0);
  EXPECT_EQ(found.st_mode & 0777, 0600U);
}

TEST_F(PeerListenerTest, OneProcessHasFewConnectionsAndGetsThemBack) {
  std::vector<int> held;
  for (std::size_t i = 1; i <= kConnectionsOfAProcess; ++i) {
    held.push_back(DialPeerSocket(Path()));
    Taken(i);
  }
  const int refused = DialPeerSocket(Path());
  EXPECT_TRUE(IsClosedByPeer(refused));
  close(refused);
  // One ends at the side that was handed out; no number is used again soon.
  const int ended = Taken(1);
  shutdown(ended, SHUT_RDWR);
  EXPECT_TRUE(IsClosedByPeer(held[0]));
  while (listener_->PeerOf(ended) != 0) std::this_thread::yield();  // the listener is woken by the end
  const int again = DialPeerSocket(Path());
  const int next = Taken(kConnectionsOfAProcess + 1);
  EXPECT_NE(next, ended);
  EXPECT_EQ(std::ranges::count(taken_, next), 1);
  held.push_back(again);
  for (const int fd : held) close(fd);
}

}  // namespace
}  // namespace tessera::agent
