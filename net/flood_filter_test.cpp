// The filter on a real socket of the loopback interface, by a time that the test moves.
#include "net/flood_filter.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <vector>

#include "net/datagram_kind.h"
#include "net/session_budget.h"
#include "net/testing/spoofed_flood.h"

namespace tessera::net {
namespace {

// A datagram socket of the loopback interface.
class LoopbackSocket {
 public:
  LoopbackSocket() {
    sockaddr_in any{};
    any.sin_family = AF_INET;
    any.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(bind(fd_, reinterpret_cast<const sockaddr*>(&any), sizeof any), 0);
    socklen_t size = sizeof address_;
    EXPECT_EQ(getsockname(fd_, reinterpret_cast<sockaddr*>(&address_), &size), 0);
  }
  ~LoopbackSocket() { close(fd_); }
  LoopbackSocket(const LoopbackSocket&) = delete;
  LoopbackSocket& operator=(const LoopbackSocket&) = delete;

  int fd() const { return fd_; }
  Address end() const { return {.host = address_.sin_addr.s_addr, .port = ntohs(address_.sin_port)}; }
  // How many of so many sealed datagrams came there.
  int Sent(int datagrams, const LoopbackSocket& to) const {
    return Sent(datagrams, std::vector<std::uint8_t>{static_cast<std::uint8_t>(DatagramKind::kDirect), 0, 0, 0}, to);
  }
  // The same of others.
  int Sent(int datagrams, const std::vector<std::uint8_t>& bytes, const LoopbackSocket& to) const {
    std::array<std::uint8_t, 128> room{};
    int came = 0;
    for (int i = 0; i < datagrams; ++i) {
      EXPECT_GT(sendto(fd_, bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&to.address_),
                       sizeof to.address_),
                0);
      if (recv(to.fd_, room.data(), room.size(), MSG_DONTWAIT) > 0) ++came;
    }
    return came;
  }

 private:
  const int fd_ = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in address_{};
};

TEST(FloodFilterTest, OfAnEndThatSendsTooMuchTheKernelPassesAShareUntilItSendsLess) {
  const LoopbackSocket port, flooder, honest;
  FloodFilter filter(port.fd());
  FloodFilter::TimePoint now(std::chrono::hours(1));
  constexpr SessionNumber kSession(7);
  std::uint64_t received = 4000;
  const auto measure = [&] {
    now += FloodFilter::kUpdate;
    filter.Measure(now, {}, [&](SessionNumber) { return std::optional(received); });
  };
  measure();
  EXPECT_EQ(flooder.Sent(100, port), 100);
  filter.Limit(now, kSession, flooder.end(), 1250, received);
  filter.Limit(now, kSession, flooder.end(), 1250, received);
  EXPECT_EQ(filter.limited(), 1U) << "once";
  ASSERT_TRUE(filter.active());
  const int at_first = flooder.Sent(4000, port);
  EXPECT_LT(at_first, 400);
  EXPECT_EQ(honest.Sent(100, port), 100) << "others' pass";
  // From 200 000 a second as many pass as the port takes.
  received += 20'000 / 64;
  measure();
  EXPECT_LT(flooder.Sent(4000, port), 200);
  measure();
  EXPECT_FALSE(filter.active()) << "nothing more came";
  EXPECT_EQ(flooder.Sent(100, port), 100);
}

TEST(FloodFilterTest, StrangersHellosKeepOutNoneThatHaveTheKnock) {
  const LoopbackSocket port, dialler;
  FloodFilter filter(port.fd());
  constexpr Knock kKnock{0xfe, 1, 2, 3};
  FloodFilter::TimePoint now(std::chrono::hours(1));
  UnprovenDatagrams seen;
  const auto measure = [&] {
    filter.Measure(now, seen, [](SessionNumber) { return std::nullopt; });
    now += FloodFilter::kUpdate;
  };
  measure();
  const std::vector<std::uint8_t> honest = BlindHello(1, kKnock), strangers = BlindHello(1);
  seen.strangers += 20'000;
  measure();
  ASSERT_TRUE(filter.active());
  EXPECT_DOUBLE_EQ(filter.strangers_that_pass(), kStrangersHellos.per_s / 200'000);
  EXPECT_LT(dialler.Sent(2000, strangers, port), 200);
  EXPECT_LT(dialler.Sent(2000, honest, port), 200) << "nobody has said which knock is the instance's";

  filter.Open(kKnock);  // amid the flood
  ASSERT_TRUE(filter.active());
  EXPECT_EQ(dialler.Sent(200, honest, port), 200);
  EXPECT_LT(dialler.Sent(2000, strangers, port), 200);
  EXPECT_EQ(dialler.Sent(200, {static_cast<std::uint8_t>(DatagramKind::kHello), 1}, port), 0) << "cut short";
  EXPECT_EQ(dialler.Sent(200, port), 200) << "a player's";
  // Hellos of one who has overheard a player's are thinned as well, and strangers' no less for it.
  seen.hellos += 20'000;
  seen.strangers += 20'000 / 200;
  measure();
  EXPECT_DOUBLE_EQ(filter.hellos_that_pass(), kHellos.per_s / 200'000);
  EXPECT_LT(dialler.Sent(2000, honest, port), 300);
  EXPECT_LT(dialler.Sent(2000, strangers, port), 200);
  measure();
  EXPECT_FALSE(filter.active()) << "nothing more came";
  EXPECT_EQ(dialler.Sent(200, strangers, port), 200);
}

TEST(FloodFilterTest, TheLimitOfASessionThatHasEndedEnds) {
  const LoopbackSocket port, flooder;
  FloodFilter filter(port.fd());
  FloodFilter::TimePoint now(std::chrono::hours(1));
  filter.Measure(now, {}, [](SessionNumber) { return std::nullopt; });
  filter.Limit(now, SessionNumber(7), flooder.end(), 1250, 0);
  EXPECT_TRUE(filter.active());
  filter.Measure(now + FloodFilter::kUpdate, {}, [](SessionNumber) { return std::nullopt; });
  EXPECT_FALSE(filter.active());
  EXPECT_EQ(filter.limited(), 0U);
}

TEST(FloodFilterTest, FarBeyondItsBudgetAnEndIsToBeLimited) {
  constexpr SessionLimits limits{.datagrams = {.per_s = 100, .burst = 10}, .bytes = {.per_s = 1e6, .burst = 1e6}};
  const FloodFilter::TimePoint start(std::chrono::hours(1));
  SessionBudget budget;
  int limited = 0;
  const auto send = [&](FloodFilter::TimePoint at, std::uint32_t count) {
    for (std::uint32_t i = 0; i < count; ++i) {
      if (!budget.Take(at, limits, 1) && budget.IsToBeLimited()) ++limited;
    }
  };
  send(start, 10 + kExcessToLimit - 1);
  EXPECT_EQ(limited, 0);
  send(start, 1);
  EXPECT_EQ(limited, 1);
  send(start + std::chrono::milliseconds(1), kExcessToLimit - 1);
  EXPECT_EQ(limited, 1);
  // After a pause it is counted anew.
  send(start + kFloodPause + std::chrono::seconds(1), 10 + kExcessToLimit - 1);
  EXPECT_EQ(limited, 1);
}

}  // namespace
}  // namespace tessera::net
