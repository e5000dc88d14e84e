#include "core/replication/input.h"

#include <cassert>
#include <limits>

#include "absl/strings/str_cat.h"
#include "core/replication/datagram.h"
#include "core/world/bytes.h"

namespace tessera::replication {
namespace {

// Null, or which field is wrong.
const char* ReadInput(ByteReader& in, std::uint32_t previous_number, PlayerInput& input) {
  const std::uint64_t number = in.Varint();
  input.body = BodyId(in.Varint());
  const std::uint64_t target = in.Varint();
  ReadSteering(in, input);
  if (number > std::numeric_limits<std::uint32_t>::max()) return "number is out of range";
  if (number <= previous_number) return "number does not ascend";
  if (target > kMaxTick) return "target is out of range";
  input.number = static_cast<std::uint32_t>(number);
  input.target = Tick(target);
  return WrongField(input);
}

}  // namespace

std::vector<std::uint8_t> EncodeInput(const InputMessage& message) {
  assert(message.ack.size() <= kMaxInputAckBytes && message.inputs.size() <= kMaxInputs);
  ByteWriter out;
  out.U8(static_cast<std::uint8_t>(DatagramKind::kInput));
  out.U8(static_cast<std::uint8_t>(message.ack.size()));
  out.Bytes(message.ack);
  out.U8(static_cast<std::uint8_t>(message.inputs.size()));
  for (const PlayerInput& input : message.inputs) {
    out.Varint(input.number);
    out.Varint(input.body.value());
    out.Varint(input.target.value());
    WriteSteering(out, input);
  }
  return out.Take();
}

absl::StatusOr<InputMessage> DecodeInput(std::span<const std::uint8_t> datagram) {
  ByteReader in(datagram);
  in.Field("input");
  if (in.U8() != static_cast<std::uint8_t>(DatagramKind::kInput)) return absl::InvalidArgumentError("input: kind");
  InputMessage message;
  const std::uint8_t ack_bytes = in.U8();
  if (ack_bytes > kMaxInputAckBytes) return absl::InvalidArgumentError("input: ack is too long");
  const std::span<const std::uint8_t> ack = in.Bytes(ack_bytes);
  message.ack.assign(ack.begin(), ack.end());
  const std::uint8_t count = in.U8();
  if (count > kMaxInputs) {
    return absl::InvalidArgumentError(absl::StrCat("input: ", count, " inputs; at most ", kMaxInputs));
  }
  std::uint32_t previous_number = 0;
  for (std::uint8_t i = 0; i < count; ++i) {
    PlayerInput input;
    const char* wrong = ReadInput(in, previous_number, input);
    if (!in.ok()) break;
    if (wrong != nullptr) return absl::InvalidArgumentError(absl::StrCat("input: inputs[", i, "].", wrong));
    previous_number = input.number;
    message.inputs.push_back(input);
  }
  if (!in.ok()) return absl::InvalidArgumentError(in.error());
  if (in.remaining() != 0) return absl::InvalidArgumentError("input: trailing bytes");
  return message;
}

}  // namespace tessera::replication
