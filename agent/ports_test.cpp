#include "agent/ports.h"

#include <set>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace tessera::agent {
namespace {

constexpr auto kAllFree = [](std::uint16_t) { return true; };

TEST(PortRangeTest, HandsOutEveryTripleOnceAndThenNone) {
  PortRange ports(7800, 7810);  // 11 ports: three triples, two left over
  EXPECT_EQ(ports.places(), 3U);
  std::set<std::uint16_t> given;
  for (int i = 0; i < 3; ++i) given.insert(ports.Take(kAllFree).value());
  EXPECT_EQ(given, (std::set<std::uint16_t>{7800, 7803, 7806}));
  EXPECT_FALSE(ports.Take(kAllFree));
}

TEST(PortRangeTest, ReturnedPortsComeLastAgain) {
  PortRange ports(7800, 7808);
  const std::uint16_t first = ports.Take(kAllFree).value();
  ports.Return(first);
  EXPECT_NE(ports.Take(kAllFree), first);
  EXPECT_NE(ports.Take(kAllFree), first);
  EXPECT_EQ(ports.Take(kAllFree), first);
}

TEST(PortRangeTest, SkipsWhatOthersHold) {
  PortRange ports(7800, 7808);
  EXPECT_EQ(ports.Take([](std::uint16_t first) { return first == 7806; }), 7806);
  EXPECT_FALSE(ports.Take([](std::uint16_t) { return false; }));
}

TEST(PortRangeTest, NeverOverlapsAnAdoptedWorkersPorts) {
  PortRange ports(7800, 7811);
  ports.Mark(7804);  // from a range with another begin: 7804 to 7806 lie in the second and the third place
  EXPECT_EQ(ports.Take(kAllFree), 7800);
  EXPECT_EQ(ports.Take(kAllFree), 7809);
  EXPECT_FALSE(ports.Take(kAllFree));
  ports.Return(7804);
  EXPECT_EQ(ports.Take(kAllFree), 7803);
}

TEST(PortRangeTest, ParsesWhatItPrintsUpToTheLastPort) {
  for (const char* text : {"1-3", "7800-8799", "65533-65535"}) {
    const auto ports = PortRange::Parse(text);
    ASSERT_TRUE(ports.ok()) << text;
    EXPECT_EQ(ports->ToString(), text);
  }
  PortRange last = PortRange::Parse("65533-65535").value();
  EXPECT_EQ(last.Take(kAllFree), 65533);
  EXPECT_FALSE(last.Take(kAllFree));
}

TEST(PortRangeTest, RefusesWhatIsNoRange) {
  for (const char* text : {"", "7800", "7800-", "-8799", "7800-7801", "8799-7800", "0-100", "65534-65536", "a-b",
                           "7800-8799-1", "-5-10"}) {
    const auto ports = PortRange::Parse(text);
    EXPECT_EQ(ports.status().code(), absl::StatusCode::kInvalidArgument) << text;
    EXPECT_THAT(std::string(ports.status().message()), ::testing::HasSubstr("\"" + std::string(text) + "\""));
  }
}

}  // namespace
}  // namespace tessera::agent
