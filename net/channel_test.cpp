#include "net/channel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>
#include <vector>

namespace tessera::net {
namespace {

using Packet = std::vector<std::uint8_t>;

Key KeyOf(std::uint8_t byte) {
  Key key;
  std::fill_n(key.data(), key.size(), byte);
  return key;
}

Packet Seal(Channel& from, const Packet& payload, std::uint32_t receiver = 77) {
  Packet datagram(kSealHeaderBytes + payload.size() + kSealTagBytes);
  std::copy(payload.begin(), payload.end(), datagram.begin() + kSealHeaderBytes);
  EXPECT_EQ(from.Seal(DatagramKind::kSealed, receiver, datagram, payload.size()), datagram.size());
  return datagram;
}

struct ChannelTest : testing::Test {
  // Takes the bytes by value because opening overwrites them.
  std::optional<Packet> Open(Packet datagram) {
    const auto payload = two.Open(datagram, &fault);
    return payload ? std::optional(Packet(payload->begin(), payload->end())) : std::nullopt;
  }
  Channel one{KeyOf(1), KeyOf(2)}, two{KeyOf(2), KeyOf(1)};
  Channel::Fault fault{};
};

TEST_F(ChannelTest, OpensToWhatWasSealed) {
  for (const std::size_t size : {0u, 1u, 15u, 16u, 64u, 1180u}) {
    Packet payload(size);
    for (std::size_t i = 0; i < size; ++i) payload[i] = static_cast<std::uint8_t>(i);
    const Packet sealed = Seal(one, payload);
    EXPECT_EQ(SessionNumberOf(sealed), 77u);
    EXPECT_EQ(Open(sealed), payload) << size;
  }
}

TEST_F(ChannelTest, TheSamePayloadNeverLooksTheSame) {
  std::set<Packet> seen;
  for (int i = 0; i < 100; ++i) {
    Packet sealed = Seal(one, {1, 2, 3, 4, 5, 6, 7, 8});
    EXPECT_TRUE(seen.insert(Packet(sealed.begin() + kSealHeaderBytes, sealed.end())).second);
  }
}

TEST_F(ChannelTest, IsTakenOnce) {
  const Packet sealed = Seal(one, {1, 2, 3});
  EXPECT_TRUE(Open(sealed));
  EXPECT_FALSE(Open(sealed));
  EXPECT_EQ(fault, Channel::Fault::kReplayed);
}

TEST_F(ChannelTest, AnyChangedBitIsRefusedAndHarmsNothing) {
  const Packet sealed = Seal(one, {1, 2, 3});
  for (std::size_t bit = 0; bit < sealed.size() * 8; ++bit) {
    Packet damaged = sealed;
    damaged[bit / 8] = static_cast<std::uint8_t>(damaged[bit / 8] ^ (1u << (bit % 8)));
    EXPECT_FALSE(Open(damaged)) << "bit " << bit;
  }
  EXPECT_TRUE(Open(sealed));
}

TEST_F(ChannelTest, WhatWasSealedForTheOtherDirectionIsRefused) {
  EXPECT_FALSE(Open(Seal(two, {1, 2, 3})));
  EXPECT_EQ(fault, Channel::Fault::kForged);
}

TEST_F(ChannelTest, AForgedNumberFarAheadDoesNotMoveTheWindow) {
  const Packet first = Seal(one, {1});
  Packet forged = Seal(one, {2});
  forged[7] = 0x7f;
  EXPECT_FALSE(Open(forged));
  EXPECT_TRUE(Open(first));
}

TEST_F(ChannelTest, AnyOrderWithinTheWindowIsTaken) {
  std::vector<Packet> sealed;
  for (std::size_t i = 0; i < ReplayWindow::kReplayBits; ++i) sealed.push_back(Seal(one, {1}));
  std::shuffle(sealed.begin(), sealed.end(), std::mt19937(5));
  for (const Packet& datagram : sealed) EXPECT_TRUE(Open(datagram));
  for (const Packet& datagram : sealed) EXPECT_FALSE(Open(datagram));
}

// Compares the window with a set that remembers every number.
TEST(ReplayWindowTest, SaysWhatASetWouldSay) {
  std::mt19937_64 random(11);
  ReplayWindow window;
  std::set<std::uint64_t> taken;
  std::uint64_t around = 1;
  for (int i = 0; i < 200'000; ++i) {
    if (random() % 4 == 0) around += random() % (random() % 100 == 0 ? 5000 : 3);
    const std::uint64_t back = random() % 1500;
    const std::uint64_t sequence = around > back ? around - back : around;
    const bool fresh =
        sequence + ReplayWindow::kReplayBits > (taken.empty() ? 0 : *taken.rbegin()) && !taken.contains(sequence);
    ASSERT_EQ(window.Fresh(sequence), fresh) << sequence;
    if (!fresh) continue;
    window.Take(sequence);
    taken.insert(sequence);
  }
}

TEST(ReplayWindowTest, CompletesTheLowHalfAcrossItsWrap) {
  ReplayWindow window;
  EXPECT_EQ(window.Complete(1), 1u);
  const std::uint64_t wrap = std::uint64_t{1} << 32;
  for (std::uint64_t sequence = 1; sequence < 3 * wrap; sequence += wrap / 4) {
    window.Take(sequence);
    for (const std::uint64_t next : {sequence + 1, sequence + 1000, sequence + wrap / 4}) {
      EXPECT_EQ(window.Complete(static_cast<std::uint32_t>(next)), next);
    }
    if (sequence < 5000) continue;
    EXPECT_EQ(window.Complete(static_cast<std::uint32_t>(sequence - 900)), sequence - 900);
  }
}

TEST(ReplayWindowTest, ZeroIsNeverFresh) { EXPECT_FALSE(ReplayWindow().Fresh(0)); }

}  // namespace
}  // namespace tessera::net
