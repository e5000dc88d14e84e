#include "control_plane/host_serial.h"

#include <gtest/gtest.h>

#include "control_plane/secrets.h"

namespace tessera::control {
namespace {

const std::string kFirst = MakeSerial([](std::size_t n) { return std::string(n, 'k'); });

TEST(HostSerialTest, EachIsTheFirstWithACountBehind) {
  ASSERT_EQ(kFirst.size(), 32u);
  const std::string second = NextHostSerial(kFirst), third = NextHostSerial(second);
  EXPECT_EQ(second, kFirst + "0001");
  EXPECT_EQ(third, kFirst + "0002");
  EXPECT_EQ(NextHostSerial(kFirst + "00ff"), kFirst + "0100");
  EXPECT_EQ(RenewalsOf(kFirst), 0u);
  EXPECT_EQ(RenewalsOf(third), 2u);
  EXPECT_EQ(NextHostSerial(kFirst + "ffff"), "");
}

TEST(HostSerialTest, TheNewestShownAndLaterOnesCountAndNoEarlierOne) {
  const std::string second = NextHostSerial(kFirst), third = NextHostSerial(second);
  EXPECT_TRUE(CountsAsSerial(second, second));
  EXPECT_TRUE(CountsAsSerial(third, kFirst)) << "as after a restore of an old backup";
  EXPECT_FALSE(CountsAsSerial(kFirst, second));
  EXPECT_FALSE(CountsAsSerial(second, third));
}

TEST(HostSerialTest, AnothersAndWhatIsNoneDoNotCount) {
  const std::string other = MakeSerial([](std::size_t n) { return std::string(n, 'l'); });
  EXPECT_FALSE(CountsAsSerial(other, kFirst));
  EXPECT_FALSE(CountsAsSerial(NextHostSerial(other), kFirst));
  EXPECT_FALSE(CountsAsSerial("", kFirst));
  EXPECT_FALSE(CountsAsSerial("", ""));
  EXPECT_FALSE(CountsAsSerial(kFirst, ""));
  for (const std::string& none : {kFirst + "0000", kFirst + "00zz", kFirst + "1", kFirst + "00001", kFirst + "-001"}) {
    EXPECT_FALSE(CountsAsSerial(none, kFirst)) << none;
    EXPECT_EQ(NextHostSerial(none), "") << none;
  }
  EXPECT_EQ(NextHostSerial("10"), "");
}

}  // namespace
}  // namespace tessera::control
