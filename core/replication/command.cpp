#include "core/replication/command.h"

#include <cassert>
#include <limits>

#include "absl/strings/str_cat.h"
#include "core/replication/datagram.h"
#include "core/world/bytes.h"

namespace tessera::replication {
namespace {

constexpr std::size_t kMaxHeaderBytes = 1 + 5 + 5 + 1, kMaxLengthBytes = 2, kMaxShownBytes = 8, kMaxInputBytes = 5;

}  // namespace

std::size_t CommandsThatFit(std::span<const Command> commands) {
  std::size_t bytes = kMaxHeaderBytes, count = 0;
  for (const Command& command : commands) {
    bytes += kMaxLengthBytes + command.bytes.size() + kMaxShownBytes + kMaxInputBytes;
    if (bytes > kMaxCommandDatagramBytes || count == kMaxCommandsInDatagram) break;
    ++count;
  }
  return count;
}

std::vector<std::uint8_t> EncodeCommands(const CommandMessage& message) {
  assert(CommandsThatFit(message.commands) == message.commands.size());
  ByteWriter out;
  out.U8(static_cast<std::uint8_t>(DatagramKind::kCommands));
  out.Varint(message.last_event);
  out.Varint(message.base);
  out.Varint(message.commands.size());
  for (const Command& command : message.commands) {
    out.Block(command.bytes);
    out.Varint(command.shown_at);
    out.Varint(command.with_input);
  }
  return out.Take();
}

absl::StatusOr<CommandMessage> DecodeCommands(std::span<const std::uint8_t> datagram) {
  ByteReader in(datagram);
  in.Field("commands");
  if (in.U8() != static_cast<std::uint8_t>(DatagramKind::kCommands)) {
    return absl::InvalidArgumentError("commands: kind");
  }
  CommandMessage message;
  message.last_event = in.Varint32();
  message.base = in.Varint32();
  const std::uint64_t count = in.Varint();
  if (in.ok() && count > kMaxCommandsInDatagram) {
    return absl::InvalidArgumentError(absl::StrCat("commands: ", count, " are more than ", kMaxCommandsInDatagram));
  }
  for (std::uint64_t i = 0; in.ok() && i < count; ++i) {
    const std::size_t size = in.Count(1);
    if (size > kMaxCommandBytes) {
      return absl::InvalidArgumentError(absl::StrCat("commands: ", size, " bytes are more than ", kMaxCommandBytes));
    }
    const std::span<const std::uint8_t> bytes = in.Bytes(size);
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    const std::uint64_t shown_at = in.Varint();
    message.commands.emplace_back(text, shown_at, in.Varint32());
  }
  if (!in.ok()) return absl::InvalidArgumentError(in.error());
  if (in.remaining() != 0) return absl::InvalidArgumentError("commands: trailing bytes");
  const bool numbered = message.base != 0 && count <= std::numeric_limits<std::uint32_t>::max() - message.base;
  if (count > 0 && !numbered) return absl::InvalidArgumentError("commands: number is out of range");
  return message;
}

}  // namespace tessera::replication
