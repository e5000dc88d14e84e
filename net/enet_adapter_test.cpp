#include "net/enet_adapter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <random>
#include <vector>

namespace tessera::net {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr std::uint16_t kNobody = ENET_PROTOCOL_MAXIMUM_PEER_ID;

// ENet's header, with or without a time, and commands after it.
Bytes Datagram(std::uint16_t peer, const std::vector<Bytes>& commands, bool timed = true) {
  const std::uint16_t head = static_cast<std::uint16_t>(peer | (timed ? ENET_PROTOCOL_HEADER_FLAG_SENT_TIME : 0));
  Bytes bytes(timed ? 4 : 2);
  bytes[0] = static_cast<std::uint8_t>(head >> 8);
  bytes[1] = static_cast<std::uint8_t>(head);
  for (const Bytes& command : commands) bytes.insert(bytes.end(), command.begin(), command.end());
  return bytes;
}

template <class T>
Bytes Command(std::uint8_t number, std::size_t payload = 0, std::size_t length_offset = 0) {
  Bytes bytes(sizeof(T) + payload);
  bytes[0] = number | ENET_PROTOCOL_COMMAND_FLAG_ACKNOWLEDGE;
  if (length_offset != 0) {
    bytes[length_offset] = static_cast<std::uint8_t>(payload >> 8);
    bytes[length_offset + 1] = static_cast<std::uint8_t>(payload);
  }
  return bytes;
}

const Bytes kConnect = Command<ENetProtocolConnect>(ENET_PROTOCOL_COMMAND_CONNECT);
const Bytes kVerify = Command<ENetProtocolVerifyConnect>(ENET_PROTOCOL_COMMAND_VERIFY_CONNECT);
const Bytes kPing = Command<ENetProtocolPing>(ENET_PROTOCOL_COMMAND_PING);
Bytes Reliable(std::size_t payload) {
  return Command<ENetProtocolSendReliable>(ENET_PROTOCOL_COMMAND_SEND_RELIABLE, payload,
                                           offsetof(ENetProtocolSendReliable, dataLength));
}

// The first fragment of a message.
Bytes Fragment(std::uint32_t total_bytes, std::uint32_t count) {
  Bytes bytes = Command<ENetProtocolSendFragment>(ENET_PROTOCOL_COMMAND_SEND_FRAGMENT, 1,
                                                  offsetof(ENetProtocolSendFragment, dataLength));
  const auto put = [&](std::size_t offset, std::uint32_t value) {
    for (int i = 0; i < 4; ++i)
      bytes[offset + static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(value >> (24 - 8 * i));
  };
  put(offsetof(ENetProtocolSendFragment, totalLength), total_bytes);
  put(offsetof(ENetProtocolSendFragment, fragmentCount), count);
  return bytes;
}

TEST(EnetAdapterTest, TellsAConnectFromTheRest) {
  EXPECT_EQ(Inspect(Datagram(kNobody, {kConnect}), false, true), Inner::kConnect);
  EXPECT_EQ(Inspect(Datagram(3, {kPing, Reliable(100), kPing}), false, true), Inner::kOther);
  EXPECT_EQ(Inspect(Datagram(3, {kPing}, false), false, true), Inner::kOther);
  EXPECT_EQ(Inspect(Datagram(3, {kVerify}), true, true), Inner::kOther);
}

TEST(EnetAdapterTest, RefusesWhatOurEndpointsNeverSay) {
  EXPECT_EQ(Inspect(Datagram(kNobody, {kConnect}), true, true), Inner::kRefused);  // from one that was dialled
  EXPECT_EQ(Inspect(Datagram(kNobody, {kConnect, kPing}), false, true), Inner::kRefused);
  EXPECT_EQ(Inspect(Datagram(3, {kConnect}), false, true), Inner::kRefused);
  EXPECT_EQ(Inspect(Datagram(3, {kVerify}), false, true), Inner::kRefused);  // to one that did not dial
  EXPECT_EQ(Inspect(Datagram(kNobody, {kPing}), false, true), Inner::kRefused);
  for (const std::uint8_t command :
       {ENET_PROTOCOL_COMMAND_NONE, ENET_PROTOCOL_COMMAND_SEND_UNRELIABLE, ENET_PROTOCOL_COMMAND_THROTTLE_CONFIGURE,
        ENET_PROTOCOL_COMMAND_SEND_UNRELIABLE_FRAGMENT, ENET_PROTOCOL_COMMAND_SEND_UNSEQUENCED,
        ENET_PROTOCOL_COMMAND_COUNT}) {
    Bytes bytes(64);
    bytes[0] = command;
    EXPECT_EQ(Inspect(Datagram(3, {bytes}), false, true), Inner::kRefused) << int{command};
  }
  Bytes compressed = Datagram(3, {kPing});
  compressed[0] = static_cast<std::uint8_t>(compressed[0] | ENET_PROTOCOL_HEADER_FLAG_COMPRESSED >> 8);
  EXPECT_EQ(Inspect(compressed, false, true), Inner::kRefused);
}

TEST(EnetAdapterTest, RefusesReliableMessagesWhereNoneAreTaken) {
  EXPECT_EQ(Inspect(Datagram(3, {kPing, Reliable(100)}), false, false), Inner::kRefused);
  EXPECT_EQ(Inspect(Datagram(3, {Fragment(1, 1)}), false, false), Inner::kRefused);
  EXPECT_EQ(Inspect(Datagram(3, {kPing}), false, false), Inner::kOther);
}

// ENet allocates memory by the count.
TEST(EnetAdapterTest, RefusesMoreFragmentsThanTheMessageHasRoomFor) {
  EXPECT_EQ(Inspect(Datagram(3, {Fragment(4000, 4)}), false, true), Inner::kOther);
  EXPECT_EQ(Inspect(Datagram(3, {Fragment(1, 1)}), false, true), Inner::kOther);
  EXPECT_EQ(Inspect(Datagram(3, {Fragment(1, 1 << 20)}), false, true), Inner::kRefused);
  EXPECT_EQ(Inspect(Datagram(3, {Fragment(4000, 9)}), false, true), Inner::kRefused);
}

TEST(EnetAdapterTest, RefusesWhatIsCutOff) {
  const Bytes whole = Datagram(3, {kPing, Reliable(20)});
  const std::size_t after_ping = 4 + kPing.size();
  for (std::size_t size = 0; size < whole.size(); ++size) {
    EXPECT_EQ(Inspect(std::span(whole).first(size), false, true), size == after_ping ? Inner::kOther : Inner::kRefused)
        << size;
  }
}

TEST(EnetAdapterTest, RestoresTheFieldAndOverwritesTheOtherSidesNumbers) {
  for (const bool timed : {false, true}) {
    Bytes room(kChecksumBytes);
    Bytes bytes = Datagram(3, {kPing, Reliable(5)}, timed);
    room.insert(room.end(), bytes.begin(), bytes.end());
    const auto datagram = Restore(std::span(room).subspan(kChecksumBytes), Inner::kOther, 0xabcd1234);
    EXPECT_EQ(datagram.size(), bytes.size() + kChecksumBytes);
    EXPECT_EQ(FieldOf(datagram), 0xabcd1234u);
    const std::size_t header = timed ? 4 : 2;
    EXPECT_TRUE(std::equal(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(header), datagram.begin()));
    EXPECT_TRUE(std::equal(bytes.begin() + static_cast<std::ptrdiff_t>(header), bytes.end(),
                           datagram.begin() + static_cast<std::ptrdiff_t>(header + kChecksumBytes)));
  }
  Bytes room(kChecksumBytes);
  const Bytes bytes = Datagram(kNobody, {kConnect});
  room.insert(room.end(), bytes.begin(), bytes.end());
  const auto datagram = Restore(std::span(room).subspan(kChecksumBytes), Inner::kConnect, 0xabcd1234);
  EXPECT_EQ(FieldOf(datagram), 0u);  // ENet has no peer yet whose number it could be
  std::uint32_t connection = 0;
  std::memcpy(&connection, datagram.data() + 8 + offsetof(ENetProtocolConnect, connectID), sizeof connection);
  EXPECT_EQ(connection, 0xabcd1234u);
}

// ENet sends the limits by itself when a peer comes or goes, together with other commands that are due.
TEST(EnetAdapterTest, ABandwidthLimitPassesAsNone) {
  Bytes limit = Command<ENetProtocolBandwidthLimit>(ENET_PROTOCOL_COMMAND_BANDWIDTH_LIMIT);
  std::fill(limit.begin() + 4, limit.end(), std::uint8_t{0xff});
  const Bytes bytes = Datagram(3, {kPing, limit, Reliable(5)});
  ASSERT_EQ(Inspect(bytes, false, true), Inner::kOther);
  Bytes room(kChecksumBytes);
  room.insert(room.end(), bytes.begin(), bytes.end());
  const auto datagram = Restore(std::span(room).subspan(kChecksumBytes), Inner::kOther, 1);
  const auto at = datagram.begin() + 8 + static_cast<std::ptrdiff_t>(kPing.size() + 4);
  EXPECT_TRUE(std::all_of(at, at + 8, [](std::uint8_t byte) { return byte == 0; }));
}

// Every payload that passes can be restored; sanitizers would report an access out of bounds.
TEST(EnetAdapterTest, RubbishIsRefusedOrWellFormed) {
  std::mt19937 random(7);
  int passed = 0;
  for (int i = 0; i < 200'000; ++i) {
    Bytes room(kChecksumBytes + random() % 80);
    for (std::uint8_t& byte : room) byte = static_cast<std::uint8_t>(random());
    if (room.size() > kChecksumBytes) room[kChecksumBytes] &= 0xbf;  // not compressed
    const auto payload = std::span(room).subspan(kChecksumBytes);
    const Inner kind = Inspect(payload, random() % 2 == 0, random() % 2 == 0);
    if (kind == Inner::kRefused) continue;
    ++passed;
    Restore(payload, kind, 1);
  }
  EXPECT_GT(passed, 0);
}

}  // namespace
}  // namespace tessera::net
