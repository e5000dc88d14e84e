// A TCP door's listener by real loopback sockets.
#include "control_plane/tcp_listener.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstddef>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "prometheus/text_serializer.h"
#include "telemetry/testing/captured_log.h"

namespace tessera::control {
namespace {

constexpr char kListenerGreeting = 'g';
constexpr int kPatience_ms = 20'000;

// Greets whom it gets, and keeps the connection.
class TcpListenerTest : public ::testing::Test {
 protected:
  void Listen(ConnectionLimits limits) {
    auto listener =
        TcpListener::Listen({.host = "127.0.0.1", .port = 0}, "operators", limits, metrics_, [this](int fd) {
          const std::lock_guard lock(mutex_);
          taken_.push_back(fd);
          (void)!write(fd, &kListenerGreeting, 1);
        });
    ASSERT_TRUE(listener.ok()) << listener.status();
    listener_ = *std::move(listener);
  }
  ~TcpListenerTest() override {
    listener_.reset();
    CloseTaken();
    for (const int fd : dialled_) close(fd);
  }
  // True: it is greeted; else its connection was closed.
  bool Dial() {
    const int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    dialled_.push_back(fd);
    sockaddr_in target{};
    target.sin_family = AF_INET;
    target.sin_port = htons(listener_->address().port);
    inet_pton(AF_INET, "127.0.0.1", &target.sin_addr);
    EXPECT_EQ(connect(fd, reinterpret_cast<const sockaddr*>(&target), sizeof target), 0);
    pollfd watched{.fd = fd, .events = POLLIN, .revents = 0};
    EXPECT_EQ(poll(&watched, 1, kPatience_ms), 1) << "neither greeted nor closed";
    char byte = 0;
    return read(fd, &byte, 1) == 1 && byte == kListenerGreeting;
  }
  void CloseTaken() {
    const std::lock_guard lock(mutex_);
    for (const int fd : taken_) close(fd);
    taken_.clear();
  }
  std::string Metrics() const { return prometheus::TextSerializer().Serialize(metrics_.registry()->Collect()); }

  ControlMetrics metrics_;
  std::unique_ptr<TcpListener> listener_;

 private:
  std::mutex mutex_;
  std::vector<int> taken_, dialled_;
};

TEST_F(TcpListenerTest, OneTooManyIsClosedAtOnceCountedAndLogged) {
  const telemetry::CapturedLog log;
  Listen({.from_address = 2, .in_all = 10});
  EXPECT_TRUE(Dial());
  EXPECT_TRUE(Dial());
  EXPECT_FALSE(Dial());
  EXPECT_NE(Metrics().find("tessera_control_refused_connections_total{door=\"operators\",reason=\"address\"} 1"),
            std::string::npos)
      << Metrics();
  CloseTaken();
  EXPECT_TRUE(Dial()) << "whoever closes has room again";
  listener_.reset();
  EXPECT_EQ(log.LinesWith("refused connection door=operators from=127.0.0.1").size(), 1u);
}

TEST_F(TcpListenerTest, ADoorHasAnEnd) {
  Listen({.from_address = 10, .in_all = 1});
  EXPECT_TRUE(Dial());
  EXPECT_FALSE(Dial());
  EXPECT_NE(Metrics().find("tessera_control_refused_connections_total{door=\"operators\",reason=\"door\"} 1"),
            std::string::npos)
      << Metrics();
}

TEST_F(TcpListenerTest, AFloodIsFewLines) {
  const telemetry::CapturedLog log;
  Listen({.from_address = 1, .in_all = 10});
  EXPECT_TRUE(Dial());
  for (int i = 0; i < 200; ++i) EXPECT_FALSE(Dial());
  listener_.reset();
  const std::size_t lines = log.LinesWith("refused connection").size();
  EXPECT_GE(lines, 1u);
  EXPECT_LT(lines, 200u) << "ten a second at most";
}

TEST_F(TcpListenerTest, APortThatIsTakenIsNotShared) {
  Listen({});
  const auto second = TcpListener::Listen(listener_->address(), "players", {}, metrics_, [](int fd) { close(fd); });
  EXPECT_EQ(second.status(),
            absl::UnavailableError("address " + ToString(listener_->address()) + " is in use (players)"));
}

TEST_F(TcpListenerTest, ANameThatLeadsNowhereIsRefusedByName) {
  const auto listener =
      TcpListener::Listen({.host = "nowhere.invalid", .port = 0}, "players", {}, metrics_, [](int fd) { close(fd); });
  EXPECT_EQ(listener.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_NE(listener.status().message().find("nowhere.invalid"), std::string::npos) << listener.status();
}

}  // namespace
}  // namespace tessera::control
