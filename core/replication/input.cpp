#include "core/replication/input.h"

#include <bit>
#include <cassert>
#include <limits>

#include "absl/strings/str_cat.h"
#include "core/replication/bit_stream.h"
#include "core/replication/datagram.h"
#include "core/replication/record_codec.h"

namespace tessera::replication {
namespace {

void WriteVector(BitWriter& writer, Vec3f v) {
  for (const float c : {v.x, v.y, v.z}) writer.Write(std::bit_cast<std::uint32_t>(c), 32);
}

Vec3f ReadVector(BitReader& reader) {
  const auto one = [&] { return std::bit_cast<float>(static_cast<std::uint32_t>(reader.Read(32))); };
  const float x = one(), y = one(), z = one();
  return {x, y, z};
}

// Null, or which field is wrong.
const char* ReadCommand(BitReader& reader, std::uint32_t previous_number, InputCommand& input) {
  const std::uint64_t number = reader.ReadVarint();
  input.body = BodyId(reader.ReadVarint());
  const std::uint64_t target = reader.ReadVarint();
  input.force_n = ReadVector(reader);
  input.torque_nm = ReadVector(reader);
  if (number > std::numeric_limits<std::uint32_t>::max()) return "number is out of range";
  if (number <= previous_number) return "number does not ascend";
  if (target > kMaxTick) return "target is out of range";
  if (!IsFinite(input.force_n)) return "force_n is not finite";
  if (!IsFinite(input.torque_nm)) return "torque_nm is not finite";
  input.number = static_cast<std::uint32_t>(number);
  input.target = Tick(target);
  return nullptr;
}

}  // namespace

std::vector<std::uint8_t> EncodeInput(const InputMessage& message) {
  assert(message.ack.size() <= kMaxInputAckBytes && message.inputs.size() <= kMaxInputs);
  BitWriter writer;
  writer.Write(static_cast<std::uint8_t>(DatagramKind::kInput), 8);
  writer.Write(message.ack.size(), 8);
  for (const std::uint8_t byte : message.ack) writer.Write(byte, 8);
  writer.Write(message.inputs.size(), 8);
  for (const InputCommand& input : message.inputs) {
    writer.WriteVarint(input.number);
    writer.WriteVarint(input.body.value());
    writer.WriteVarint(input.target.value());
    WriteVector(writer, input.force_n);
    WriteVector(writer, input.torque_nm);
  }
  return writer.Finish();
}

absl::StatusOr<InputMessage> DecodeInput(std::span<const std::uint8_t> datagram) {
  BitReader reader(datagram);
  if (reader.Read(8) != static_cast<std::uint8_t>(DatagramKind::kInput)) {
    return absl::InvalidArgumentError("input: kind");
  }
  InputMessage message;
  const std::uint64_t ack_bytes = reader.Read(8);
  if (ack_bytes > kMaxInputAckBytes) return absl::InvalidArgumentError("input: ack is too long");
  for (std::uint64_t i = 0; i < ack_bytes; ++i) message.ack.push_back(static_cast<std::uint8_t>(reader.Read(8)));
  const std::uint64_t count = reader.Read(8);
  if (count > kMaxInputs) {
    return absl::InvalidArgumentError(absl::StrCat("input: ", count, " inputs; at most ", kMaxInputs));
  }
  std::uint32_t previous_number = 0;
  for (std::uint64_t i = 0; i < count; ++i) {
    InputCommand input;
    const char* wrong = ReadCommand(reader, previous_number, input);
    if (!reader.ok()) break;
    if (wrong != nullptr) return absl::InvalidArgumentError(absl::StrCat("input: inputs[", i, "].", wrong));
    previous_number = input.number;
    message.inputs.push_back(input);
  }
  if (!reader.ok()) return absl::InvalidArgumentError("input: truncated");
  if (!reader.AtEnd()) return absl::InvalidArgumentError("input: trailing bytes");
  return message;
}

}  // namespace tessera::replication
