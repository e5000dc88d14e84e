#include "core/world/bytes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace tessera {
namespace {

TEST(BytesTest, AllKindsComeBackToTheBit) {
  ByteWriter out;
  out.U8(0xab);
  out.U16(0x1234);
  out.U32(0xdeadbeef);
  out.U64(0x0123456789abcdef);
  out.Varint(300);
  out.F32(-0.0F);
  out.F64(1e-300);
  out.V(Vec3f(1, 2, 3));
  out.V(Vec3d(4, 5, 6));
  out.Q({0.6, 0, 0, 0.8});
  out.Block(std::string_view("name"));
  out.Bytes(std::vector<std::uint8_t>{7, 8});
  out.PadTo(out.size() + 3);
  const std::vector<std::uint8_t> bytes = out.Take();
  EXPECT_EQ(out.size(), 0u);

  ByteReader in(bytes);
  EXPECT_EQ(in.U8(), 0xab);
  EXPECT_EQ(in.U16(), 0x1234);
  EXPECT_EQ(in.U32(), 0xdeadbeef);
  EXPECT_EQ(in.U64(), 0x0123456789abcdefu);
  EXPECT_EQ(in.Varint(), 300u);
  EXPECT_TRUE(std::signbit(in.F32()));
  EXPECT_EQ(in.F64(), 1e-300);
  EXPECT_EQ(in.V3f(), Vec3f(1, 2, 3));
  EXPECT_EQ(in.V3d(), Vec3d(4, 5, 6));
  EXPECT_EQ(in.Q().w, 0.8);
  const auto name = in.Block(4);
  EXPECT_EQ(std::string(name.begin(), name.end()), "name");
  std::array<std::uint8_t, 2> two{};
  in.Fill(two);
  EXPECT_EQ(two[1], 8);
  EXPECT_EQ(in.remaining(), 3u);
  EXPECT_TRUE(in.ok());
  EXPECT_EQ(in.error(), "");
}

TEST(BytesTest, NumbersAreLittleEndianAndVarintsHaveSevenBitsAByte) {
  ByteWriter out;
  out.U32(0x04030201);
  out.Varint(0x80);
  EXPECT_EQ(out.Take(), (std::vector<std::uint8_t>{1, 2, 3, 4, 0x80, 1}));
}

TEST(BytesTest, EveryVarintComesBack) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 10'000; ++i) {
    const std::uint64_t number = random() >> random() % 64;
    ByteWriter out;
    out.Varint(number);
    ByteReader in(out.bytes());
    EXPECT_EQ(in.Varint(), number);
    EXPECT_TRUE(in.ok() && in.remaining() == 0);
  }
}

TEST(BytesTest, TheFirstFailureNamesItsFieldAndStays) {
  const std::vector<std::uint8_t> bytes{1, 2};
  ByteReader in(bytes);
  in.Field("first");
  EXPECT_EQ(in.U8(), 1);
  in.Field("second");
  EXPECT_EQ(in.U32(), 0u);
  in.Field("third");
  EXPECT_EQ(in.U8(), 0);  // although a byte is left
  EXPECT_TRUE(in.Bytes(1).empty());
  EXPECT_FALSE(in.ok());
  EXPECT_EQ(in.error(), "second: truncated");
}

TEST(BytesTest, NumbersBeyondTheirWidthAndCountsBeyondTheRestFail) {
  ByteWriter out;
  out.Varint(std::uint64_t{1} << 32);
  ByteReader wide(out.bytes());
  wide.Field("region");
  EXPECT_EQ(wide.Varint32(), 0u);
  EXPECT_EQ(wide.error(), "region: out of range");

  const std::vector<std::uint8_t> endless(11, 0xff);
  ByteReader in(endless);
  EXPECT_EQ(in.Varint(), 0u);
  EXPECT_FALSE(in.ok());

  const std::vector<std::uint8_t> count{4, 0, 0, 0, 0, 0, 0};
  ByteReader three(count), two(count);
  EXPECT_EQ(three.Count(2), 0u);
  EXPECT_FALSE(three.ok());
  EXPECT_EQ(two.Count(1), 4u);
}

TEST(BytesTest, ABlockKeepsToItsLimit) {
  ByteWriter out;
  out.Block(std::string_view("abc"));
  ByteReader in(out.bytes());
  EXPECT_TRUE(in.Block(2).empty());
  EXPECT_EQ(in.error(), "too long");
}

}  // namespace
}  // namespace tessera
