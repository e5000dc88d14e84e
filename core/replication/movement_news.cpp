#include "core/replication/movement_news.h"

#include "absl/strings/str_cat.h"
#include "core/replication/datagram.h"
#include "core/world/bytes.h"

namespace tessera::replication {

std::vector<std::uint8_t> EncodeMovementNews(const MovementNews& news) {
  ByteWriter out;
  out.U8(static_cast<std::uint8_t>(DatagramKind::kMovement));
  out.U8(kMovementNewsFormat);
  out.Varint(news.tick.value());
  out.Block(news.name);
  Write(out, news.state);
  return out.Take();
}

absl::StatusOr<MovementNews> DecodeMovementNews(std::span<const std::uint8_t> datagram) {
  ByteReader in(datagram);
  in.Field("movement.kind");
  if (in.U8() != static_cast<std::uint8_t>(DatagramKind::kMovement) && in.ok()) in.Fail("not of a movement");
  in.Field("movement.format");
  const std::uint8_t format = in.U8();
  if (in.ok() && format != kMovementNewsFormat) {
    return absl::InvalidArgumentError(absl::StrCat("movement: format ", format, ", expected ", kMovementNewsFormat));
  }
  in.Field("movement.tick");
  MovementNews news;
  news.tick = Tick(in.Varint());
  if (news.tick.value() > kMaxTick) in.Fail("out of range");
  in.Field("movement.name");
  const std::span<const std::uint8_t> name = in.Block(TESSERA_MAX_MOVEMENT_NAME);
  news.name.assign(name.begin(), name.end());
  if (news.name.empty()) in.Fail("is empty");
  in.Field("movement.state");
  news.state = ReadMovementState(in);
  if (news.state.body == BodyId()) in.Fail("is nobody's");
  if (!in.ok()) return absl::InvalidArgumentError(in.error());
  if (in.remaining() != 0) return absl::InvalidArgumentError("movement: trailing bytes");
  return news;
}

}  // namespace tessera::replication
