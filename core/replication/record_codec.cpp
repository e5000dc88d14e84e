#include "core/replication/record_codec.h"

#include <bit>
#include <limits>

#include "core/replication/datagram.h"

namespace tessera::replication {
namespace {

constexpr std::uint8_t kGapBands[] = {0, 3, 7, 12};
constexpr std::uint8_t kEpochBands[] = {2, 6, 12};
constexpr std::uint8_t kRegionBands[] = {4, 10};
constexpr std::uint8_t kLengthBands[] = {4, 6, 10};
// Parameters of codes, and the longest zigzag numbers in them.
constexpr int kEpochParameter = 1, kFarParameter = 20, kVelocityParameter = 6;
constexpr int kMaxEpochBits = 33, kMaxPositionBits = 47, kMaxVelocityBits = 24;

using Velocity = std::array<std::int32_t, 3>;

void AppendVelocity(PackedRecord& record, const Velocity& velocity) {
  record.Append(velocity != Velocity{} ? 1 : 0, 1);
  if (velocity == Velocity{}) return;
  for (const std::int32_t c : velocity) AppendGolomb(record, c, kVelocityParameter);
}

bool ReadVelocity(BitReader& reader, Velocity& velocity) {
  velocity = {};
  if (!reader.ReadBit()) return true;
  for (std::int32_t& c : velocity) {
    std::int64_t value = 0;
    if (!ReadGolomb(reader, kVelocityParameter, kMaxVelocityBits, value)) return false;
    if (value < -kMaxVelocity || value > kMaxVelocity) return false;
    c = static_cast<std::int32_t>(value);
  }
  return true;
}

void AppendTraits(PackedRecord& record, const BodyTraits& traits) {
  record.Append(traits.jumps, 8);
  const BodyTuning& tuning = traits.tuning;
  for (const std::optional<float>& value : {tuning.gravity_scale, tuning.friction, tuning.restitution}) {
    record.Append(value ? 1 : 0, 1);
    if (value) record.Append(std::bit_cast<std::uint32_t>(*value), 32);
  }
  record.Append(tuning.claim ? 1 : 0, 1);
  if (!tuning.claim) return;
  record.Append(tuning.claim->player.value(), 32);
  record.Append(tuning.claim->command, 32);
}

bool ReadTraits(BitReader& reader, BodyTraits& traits) {
  traits.jumps = static_cast<std::uint8_t>(reader.Read(8));
  BodyTuning& tuning = traits.tuning;
  for (std::optional<float>* value : {&tuning.gravity_scale, &tuning.friction, &tuning.restitution}) {
    if (reader.ReadBit()) *value = std::bit_cast<float>(static_cast<std::uint32_t>(reader.Read(32)));
  }
  if (reader.ReadBit()) {
    const PlayerNumber player(static_cast<std::uint32_t>(reader.Read(32)));
    tuning.claim = SpawnClaim{player, static_cast<std::uint32_t>(reader.Read(32))};
  }
  return IsSane(tuning) && !traits.empty();
}

bool ReadPosition(BitReader& reader, const Quantizer& quantizer, bool in_bounds, QuantizedState& state) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::int64_t c = 0;
    if (in_bounds) {
      c = static_cast<std::int64_t>(reader.Read(quantizer.position_bits(axis)));
    } else if (!ReadGolomb(reader, kFarParameter, kMaxPositionBits, c)) {
      return false;
    }
    if (c < -kMaxPosition || c > kMaxPosition) return false;
    state.position[axis] = c;
  }
  return true;
}

bool ReadOrientation(BitReader& reader, const Quantizer& quantizer, QuantizedState& state) {
  state.largest = static_cast<std::uint8_t>(reader.Read(2));
  for (std::int16_t& c : state.smallest) {
    const auto value = static_cast<std::int32_t>(reader.Read(quantizer.orientation_bits()));
    if (value > 2 * quantizer.orientation_limit()) return false;
    c = static_cast<std::int16_t>(value - quantizer.orientation_limit());
  }
  return true;
}

}  // namespace

void WriteHeader(BitWriter& writer, const SnapshotHeader& header) {
  writer.Write(static_cast<std::uint8_t>(DatagramKind::kSnapshot), 8);
  writer.Write(header.fingerprint, 16);
  writer.Write(header.sequence, 32);
  writer.WriteVarint(header.tick.value());
  writer.WriteVarint(header.last_input);
  writer.WriteVarint(ZigZag(header.input_margin_ticks));
}

absl::Status ReadHeader(BitReader& reader, SnapshotHeader& header) {
  if (reader.Read(8) != static_cast<std::uint8_t>(DatagramKind::kSnapshot)) {
    return absl::InvalidArgumentError("snapshot: kind");
  }
  header.fingerprint = static_cast<std::uint16_t>(reader.Read(16));
  header.sequence = static_cast<std::uint32_t>(reader.Read(32));
  const std::uint64_t tick = reader.ReadVarint();
  const std::uint64_t last_input = reader.ReadVarint();
  const std::int64_t margin = UnZigZag(reader.ReadVarint());
  if (!reader.ok()) return absl::InvalidArgumentError("snapshot: truncated header");
  if (header.sequence == 0) return absl::InvalidArgumentError("snapshot: sequence 0");
  if (tick > kMaxTick) return absl::InvalidArgumentError("snapshot: tick");
  if (last_input > std::numeric_limits<std::uint32_t>::max()) {
    return absl::InvalidArgumentError("snapshot: last_input");
  }
  if (margin < std::numeric_limits<std::int32_t>::min() || margin > std::numeric_limits<std::int32_t>::max()) {
    return absl::InvalidArgumentError("snapshot: input_margin");
  }
  header.tick = Tick(tick);
  header.last_input = static_cast<std::uint32_t>(last_input);
  header.input_margin_ticks = static_cast<std::int32_t>(margin);
  return absl::OkStatus();
}

void WriteIdGap(BitWriter& writer, BodyId previous, BodyId id) {
  assert(id > previous);
  writer.WriteBanded(id.value() - previous.value() - 1, kGapBands);
}

std::optional<BodyId> ReadIdGap(BitReader& reader, BodyId previous) {
  const std::uint64_t gap = reader.ReadBanded(kGapBands);
  if (gap >= std::numeric_limits<std::uint64_t>::max() - previous.value()) return std::nullopt;
  return BodyId(previous.value() + gap + 1);
}

void WriteDeparture(BitWriter& writer, const DepartureRecord& departure) {
  writer.WriteBanded(departure.epoch.value(), kEpochBands);
  writer.Write(static_cast<std::uint64_t>(departure.why), 2);
  if (departure.why == DepartureRecord::Why::kHandedOver) writer.WriteBanded(departure.to.value(), kRegionBands);
}

bool ReadDeparture(BitReader& reader, DepartureRecord& departure) {
  constexpr std::uint64_t kMax = std::numeric_limits<std::uint32_t>::max();
  const std::uint64_t epoch = reader.ReadBanded(kEpochBands);
  const std::uint64_t why = reader.Read(2);
  if (epoch > kMax || why > static_cast<std::uint64_t>(DepartureRecord::Why::kOutOfInterest)) return false;
  departure.epoch = Epoch(static_cast<std::uint32_t>(epoch));
  departure.why = static_cast<DepartureRecord::Why>(why);
  departure.to = RegionId();
  if (departure.why != DepartureRecord::Why::kHandedOver) return true;
  const std::uint64_t to = reader.ReadBanded(kRegionBands);
  if (to == 0 || to > kMax) return false;
  departure.to = RegionId(static_cast<std::uint32_t>(to));
  return true;
}

PackedRecord PackFull(const Quantizer& quantizer, Epoch epoch, const QuantizedState& state, const BodyTraits& traits) {
  PackedRecord record;
  AppendGolomb(record, epoch.value(), kEpochParameter);
  const bool in_bounds = quantizer.InBounds(state);
  record.Append((state.asleep ? 1u : 0u) | (in_bounds ? 2u : 0u) | (traits.empty() ? 0u : 4u), 3);
  if (!traits.empty()) AppendTraits(record, traits);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (in_bounds) {
      record.Append(static_cast<std::uint64_t>(state.position[axis]), quantizer.position_bits(axis));
    } else {
      AppendGolomb(record, state.position[axis], kFarParameter);
    }
  }
  record.Append(state.largest, 2);
  for (const std::int16_t c : state.smallest) {
    record.Append(static_cast<std::uint64_t>(std::int64_t{c} + quantizer.orientation_limit()),
                  quantizer.orientation_bits());
  }
  if (state.asleep) return record;
  AppendVelocity(record, state.linear);
  AppendVelocity(record, state.angular);
  return record;
}

bool ReadFull(BitReader& reader, const Quantizer& quantizer, Epoch& epoch, QuantizedState& state, BodyTraits& traits) {
  state = QuantizedState();
  std::int64_t number = 0;
  if (!ReadGolomb(reader, kEpochParameter, kMaxEpochBits, number)) return false;
  if (number < 0 || number > std::numeric_limits<std::uint32_t>::max()) return false;
  epoch = Epoch(static_cast<std::uint32_t>(number));
  state.asleep = reader.ReadBit();
  const bool in_bounds = reader.ReadBit();
  traits = {};
  if (reader.ReadBit() && !ReadTraits(reader, traits)) return false;
  if (!ReadPosition(reader, quantizer, in_bounds, state) || !ReadOrientation(reader, quantizer, state)) return false;
  return state.asleep || (ReadVelocity(reader, state.linear) && ReadVelocity(reader, state.angular));
}

void WriteProperties(BitWriter& writer, const Bytes& properties) {
  writer.WriteBanded(properties.size(), kLengthBands);
  for (const std::uint8_t byte : properties) writer.Write(byte, 8);
}

bool ReadProperties(BitReader& reader, Bytes& properties) {
  const std::uint64_t size = reader.ReadBanded(kLengthBands);
  if (size > kMaxPropertyBytes) return false;
  properties.resize(size);
  for (std::uint8_t& byte : properties) byte = static_cast<std::uint8_t>(reader.Read(8));
  return true;
}

}  // namespace tessera::replication
