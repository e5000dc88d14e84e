#include "core/region/message_packet.h"

#include "absl/strings/str_cat.h"
#include "core/game/blast.h"
#include "core/game/question.h"
#include "core/region/catalog.h"
#include "core/region/frame_check.h"
#include "core/world/properties.h"

namespace tessera::region {
namespace {

constexpr std::size_t kMinPacketBytes = 8;

absl::Status BadPacket(const MessagePacket& packet, absl::string_view what) {
  return absl::InvalidArgumentError(absl::StrCat("a packet of body ", packet.from.value(), ": ", what));
}

bool HasOrigin(PacketKind kind) {
  return kind == PacketKind::kMessage || kind == PacketKind::kInstance || kind == PacketKind::kQuestion ||
         kind == PacketKind::kAnswer || kind == PacketKind::kBlast;
}

std::size_t MostBytes(PacketKind kind) {
  switch (kind) {
    case PacketKind::kQuestion:
      return game::kMaxQuestionBytes;
    case PacketKind::kAnswer:
      return game::kMaxAnswerBytes;
    default:
      return kMaxPropertyBytes;
  }
}

}  // namespace

void Write(ByteWriter& out, const std::vector<MessagePacket>& packets) {
  out.Varint(packets.size());
  for (const MessagePacket& packet : packets) {
    out.U8(static_cast<std::uint8_t>(packet.kind));
    out.Varint(packet.from.value());
    out.Varint(packet.to.value());
    out.Varint(packet.number);
    out.Varint(packet.origin.value());
    out.Varint(packet.via.value());
    out.Varint(packet.sent.value());
    if (!HasOrigin(packet.kind)) continue;
    out.Varint(packet.made.value());
    out.Varint(packet.made_in.value());
    if (packet.kind == PacketKind::kMessage) {
      out.Varint(packet.after);
      game::Write(out, packet.what);
    } else {
      out.Block(packet.properties);
    }
  }
}

void Read(ByteReader& in, std::vector<MessagePacket>& packets) {
  packets.resize(in.Count(kMinPacketBytes - 1));
  if (packets.size() > kMaxPackets) in.Fail("too many packets");
  for (MessagePacket& packet : packets) {
    if (!in.ok()) return;
    const std::uint8_t kind = in.U8();
    if (kind < static_cast<std::uint8_t>(PacketKind::kMessage) ||
        kind > static_cast<std::uint8_t>(PacketKind::kBlast)) {
      in.Fail("a packet of an unknown kind");
      return;
    }
    packet.kind = static_cast<PacketKind>(kind);
    packet.from = BodyId(in.Varint());
    packet.to = BodyId(in.Varint());
    packet.number = in.Varint();
    packet.origin = RegionId(in.Varint32());
    packet.via = RegionId(in.Varint32());
    packet.sent = Tick(in.Varint());
    if (!HasOrigin(packet.kind)) continue;
    packet.made = Tick(in.Varint());
    packet.made_in = RegionId(in.Varint32());
    if (packet.kind == PacketKind::kMessage) {
      packet.after = in.Varint();
      game::ReadMessage(in, packet.what);
    } else {
      const auto bytes = in.Block(MostBytes(packet.kind));
      packet.properties.assign(bytes.begin(), bytes.end());
    }
  }
}

absl::Status CheckPacket(const MessagePacket& packet, const Catalog& catalog) {
  if (!catalog.has_game()) return BadPacket(packet, "no game runs here");
  if (absl::Status status = CheckKnown(packet.from, catalog); !status.ok()) return status;
  if (packet.kind == PacketKind::kInstance) {
    if (packet.from != kInstanceBody || packet.to != BodyId()) return BadPacket(packet, "is not the world's");
    const auto set = PropertySet::Decode(packet.properties, catalog.scene().instance_properties);
    return set.ok() ? absl::OkStatus() : BadPacket(packet, set.status().message());
  }
  if (packet.kind == PacketKind::kQuestion || packet.kind == PacketKind::kAnswer) {
    if (packet.to != BodyId() || packet.via == RegionId()) return BadPacket(packet, "a question is for a region");
    const absl::Status status = packet.kind == PacketKind::kQuestion
                                    ? game::DecodeQuestion(packet.properties, catalog.scene()).status()
                                    : game::DecodeAnswer(packet.properties).status();
    return status.ok() ? status : BadPacket(packet, status.message());
  }
  if (packet.kind == PacketKind::kBlast) {
    ByteReader in(packet.properties);
    game::Blast blast;
    game::ReadBlast(in, blast);
    if (!in.ok() || in.remaining() != 0 || blast.id != packet.number) return BadPacket(packet, "no blast");
    const absl::Status status = game::CheckBlast(blast);
    return status.ok() ? status : BadPacket(packet, status.message());
  }
  if (packet.kind == PacketKind::kPlace) {
    return packet.to == BodyId() ? absl::OkStatus() : BadPacket(packet, "a place is for all");
  }
  if (absl::Status status = CheckKnown(packet.to, catalog); !status.ok()) return status;
  if (packet.kind != PacketKind::kMessage) return absl::OkStatus();
  if (packet.number == 0 || packet.after >= packet.number) return BadPacket(packet, "numbers do not ascend");
  if (absl::Status status = game::CheckMessage(packet.what); !status.ok()) return BadPacket(packet, status.message());
  return absl::OkStatus();
}

}  // namespace tessera::region
