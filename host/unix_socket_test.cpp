#include "host/unix_socket.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <string>

#include "host/temporary_folder.h"

namespace tessera::host {
namespace {

using ::testing::HasSubstr;

TEST(UnixSocketTest, IsThisUsersAloneAndTakesConnections) {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/door.sock";
  const auto listening = ListenOnUnixSocket(path);
  ASSERT_TRUE(listening.ok()) << listening.status();
  struct stat made {};
  ASSERT_EQ(stat(path.c_str(), &made), 0);
  EXPECT_EQ(made.st_mode & 0777, 0600u);

  const int caller = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  ASSERT_GE(caller, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::copy(path.begin(), path.end(), address.sun_path);
  EXPECT_EQ(connect(caller, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  const int taken = accept(*listening, nullptr, nullptr);
  EXPECT_GE(taken, 0);
  for (const int fd : {taken, caller, *listening}) close(fd);
}

TEST(UnixSocketTest, RefusesAPathThatIsTakenOrTooLong) {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/door.sock";
  const auto listening = ListenOnUnixSocket(path);
  ASSERT_TRUE(listening.ok()) << listening.status();
  EXPECT_THAT(std::string(ListenOnUnixSocket(path).status().message()), HasSubstr(path + ": Address already in use"));
  const std::string too_long(108, 'x');
  EXPECT_THAT(std::string(ListenOnUnixSocket(too_long).status().message()), HasSubstr("File name too long"));
  close(*listening);
}

}  // namespace
}  // namespace tessera::host
