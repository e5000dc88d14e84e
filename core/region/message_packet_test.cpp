#include "core/region/message_packet.h"

#include <gmock/gmock.h>

#include "core/region/catalog.h"
#include "core/region/testing/small_world.h"

namespace tessera::region {
namespace {

using ::testing::HasSubstr;

std::vector<MessagePacket> OneOfEach() {
  MessagePacket message;
  message.from = BodyId(1);
  message.to = BodyId(2);
  message.number = 5;
  message.after = 3;
  message.origin = RegionId(4);
  message.via = RegionId(2);
  message.sent = Tick(100);
  message.made = Tick(97);
  message.made_in = RegionId(4);
  message.what = {BodyId(1), 0, "hit", {}};
  MessagePacket answer;
  answer.kind = PacketKind::kAcknowledged;
  answer.from = BodyId(2);
  answer.to = BodyId(1);
  answer.number = 5;
  MessagePacket instance;
  instance.kind = PacketKind::kInstance;
  instance.from = kInstanceBody;
  instance.number = 2;
  instance.made = Tick(9);
  MessagePacket place;
  place.kind = PacketKind::kPlace;
  place.from = BodyId(2);
  place.number = 3;
  return {message, answer, instance, place};
}

TEST(MessagePacketTest, ComesBackAsItWas) {
  ByteWriter out;
  Write(out, OneOfEach());
  const std::vector<std::uint8_t> bytes = out.Take();
  std::vector<MessagePacket> packets;
  ByteReader in(bytes);
  Read(in, packets);
  EXPECT_TRUE(in.ok()) << in.error();
  EXPECT_EQ(in.remaining(), 0U);
  EXPECT_EQ(packets, OneOfEach());
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    ByteReader cut({bytes.data(), size});
    Read(cut, packets);
    EXPECT_FALSE(cut.ok()) << size;
  }
}

TEST(MessagePacketTest, WhatNoRegionSendsIsRefused) {
  Scene scene = Balls({{-1, 0, 0}, {1, 0, 0}});
  scene.instance_properties = {{"score", std::int64_t{0}}};
  const auto shared = std::make_shared<const Scene>(std::move(scene));
  const Catalog catalog(shared, true), without_game(shared);
  for (const MessagePacket& packet : OneOfEach()) {
    EXPECT_TRUE(CheckPacket(packet, catalog).ok()) << CheckPacket(packet, catalog);
    EXPECT_FALSE(CheckPacket(packet, without_game).ok());
  }
  const auto refused = [&](std::size_t which, const auto& change) {
    MessagePacket packet = OneOfEach()[which];
    change(packet);
    return std::string(CheckPacket(packet, catalog).message());
  };
  EXPECT_THAT(refused(0, [](auto& packet) { packet.to = BodyId(9); }), HasSubstr("body 9 is not a dynamic body"));
  EXPECT_THAT(refused(0, [](auto& packet) { packet.after = 5; }), HasSubstr("numbers do not ascend"));
  EXPECT_THAT(refused(0, [](auto& packet) { packet.what.values = {7}; }), HasSubstr("a packet of body 1: values"));
  EXPECT_THAT(refused(3, [](auto& packet) { packet.to = BodyId(1); }), HasSubstr("a place is for all"));
  EXPECT_THAT(refused(2, [](auto& packet) { packet.from = BodyId(1); }), HasSubstr("is not the world's"));
  EXPECT_THAT(refused(2, [](auto& packet) { packet.properties = {99}; }), HasSubstr("a packet of body"));
}

}  // namespace
}  // namespace tessera::region
