#include "core/replication/record_codec.h"

#include <limits>

#include "core/replication/datagram.h"

namespace tessera::replication {
namespace {

// Widths, in bits, that were measured shortest on 500 bodies that roll and collide (snapshot_size_test.cpp).
constexpr std::uint8_t kGapBands[] = {0, 3, 7, 12};
constexpr std::uint8_t kEpochBands[] = {2, 6, 12};
constexpr std::uint8_t kAgeBands[] = {3, 6, 12};
constexpr std::uint8_t kRegionBands[] = {4, 10};
constexpr std::uint8_t kFullVelocityBands[] = {0, 5, 8, 11, 16};
constexpr std::uint8_t kVelocityBands[] = {1, 3, 5, 8, 12};
constexpr std::uint8_t kPositionBands[] = {1, 2, 4, 7, 12};
constexpr std::uint8_t kOrientationBands[] = {1, 2, 4, 6, 11};

using Velocity = std::array<std::int32_t, 3>;

void WriteVelocity(BitWriter& writer, const Velocity& velocity, const Velocity& base, Bands bands) {
  writer.WriteBit(velocity != base);
  if (velocity == base) return;
  for (std::size_t i = 0; i < 3; ++i) writer.WriteBanded(ZigZag(std::int64_t{velocity[i]} - base[i]), bands);
}

bool ReadVelocity(BitReader& reader, const Velocity& base, Bands bands, Velocity& velocity) {
  velocity = base;
  if (!reader.ReadBit()) return true;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::int64_t change = UnZigZag(reader.ReadBanded(bands));
    if (change < -2 * kMaxVelocity || change > 2 * kMaxVelocity) return false;
    const std::int64_t value = base[i] + change;
    if (value < -kMaxVelocity || value > kMaxVelocity) return false;
    velocity[i] = static_cast<std::int32_t>(value);
  }
  return true;
}

void WriteOrientation(BitWriter& writer, const Quantizer& quantizer, const QuantizedState& state) {
  writer.Write(state.largest, 2);
  for (const std::int16_t c : state.smallest) {
    writer.Write(static_cast<std::uint32_t>(c + quantizer.orientation_limit()), quantizer.orientation_bits());
  }
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

bool ReadPositionResidual(BitReader& reader, std::array<std::int64_t, 3>& position) {
  for (std::int64_t& c : position) {
    const std::int64_t residual = UnZigZag(reader.ReadBanded(kPositionBands));
    if (residual < -2 * kMaxPosition || residual > 2 * kMaxPosition) return false;
    c += residual;
    if (c < -kMaxPosition || c > kMaxPosition) return false;
  }
  return true;
}

bool ReadOrientationResidual(BitReader& reader, const Quantizer& quantizer, QuantizedState& state) {
  if (!reader.ReadBit()) return ReadOrientation(reader, quantizer, state);
  const std::int64_t limit = quantizer.orientation_limit();
  for (std::int16_t& c : state.smallest) {
    const std::int64_t residual = UnZigZag(reader.ReadBanded(kOrientationBands));
    if (residual < -2 * limit || residual > 2 * limit) return false;
    const std::int64_t value = c + residual;
    if (value < -limit || value > limit) return false;
    c = static_cast<std::int16_t>(value);
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

void WriteEpoch(BitWriter& writer, Epoch epoch) { writer.WriteBanded(epoch.value(), kEpochBands); }

std::optional<Epoch> ReadEpoch(BitReader& reader) {
  const std::uint64_t epoch = reader.ReadBanded(kEpochBands);
  if (epoch > std::numeric_limits<std::uint32_t>::max()) return std::nullopt;
  return Epoch(static_cast<std::uint32_t>(epoch));
}

void WriteDeparture(BitWriter& writer, const DepartureRecord& departure) {
  WriteEpoch(writer, departure.epoch);
  writer.WriteBanded(departure.to.value(), kRegionBands);
}

bool ReadDeparture(BitReader& reader, DepartureRecord& departure) {
  const std::optional<Epoch> epoch = ReadEpoch(reader);
  const std::uint64_t to = reader.ReadBanded(kRegionBands);
  if (!epoch.has_value() || to > std::numeric_limits<std::uint32_t>::max()) return false;
  departure.epoch = *epoch;
  departure.to = RegionId(static_cast<std::uint32_t>(to));
  return true;
}

void WriteBaselineAge(BitWriter& writer, std::uint64_t age, std::uint64_t previous) {
  writer.WriteBit(age == previous);
  if (age != previous) writer.WriteBanded(age - 1, kAgeBands);
}

std::uint64_t ReadBaselineAge(BitReader& reader, std::uint64_t previous) {
  return reader.ReadBit() ? previous : reader.ReadBanded(kAgeBands) + 1;
}

void WriteFull(BitWriter& writer, const Quantizer& quantizer, const QuantizedState& state) {
  writer.WriteBit(state.asleep);
  const bool in_bounds = quantizer.InBounds(state);
  writer.WriteBit(in_bounds);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (in_bounds) {
      writer.Write(static_cast<std::uint64_t>(state.position[axis]), quantizer.position_bits(axis));
    } else {
      writer.WriteVarint(ZigZag(state.position[axis]));
    }
  }
  WriteOrientation(writer, quantizer, state);
  if (state.asleep) return;
  WriteVelocity(writer, state.linear, {}, kFullVelocityBands);
  WriteVelocity(writer, state.angular, {}, kFullVelocityBands);
}

bool ReadFull(BitReader& reader, const Quantizer& quantizer, QuantizedState& state) {
  state = QuantizedState();
  state.asleep = reader.ReadBit();
  const bool in_bounds = reader.ReadBit();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::int64_t c = in_bounds ? static_cast<std::int64_t>(reader.Read(quantizer.position_bits(axis)))
                                     : UnZigZag(reader.ReadVarint());
    if (c < -kMaxPosition || c > kMaxPosition) return false;
    state.position[axis] = c;
  }
  if (!ReadOrientation(reader, quantizer, state)) return false;
  return state.asleep || (ReadVelocity(reader, {}, kFullVelocityBands, state.linear) &&
                          ReadVelocity(reader, {}, kFullVelocityBands, state.angular));
}

void WriteDelta(BitWriter& writer, const Quantizer& quantizer, const QuantizedState& state, const QuantizedState& base,
                std::uint64_t ticks) {
  writer.WriteBit(state.asleep);
  if (!state.asleep) {
    WriteVelocity(writer, state.linear, base.linear, kVelocityBands);
    WriteVelocity(writer, state.angular, base.angular, kVelocityBands);
  }
  QuantizedState predicted = state;
  quantizer.Predict(base, ticks, predicted);
  writer.WriteBit(state.position != predicted.position);
  if (state.position != predicted.position) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      writer.WriteBanded(ZigZag(state.position[axis] - predicted.position[axis]), kPositionBands);
    }
  }
  const bool turned = state.largest != predicted.largest || state.smallest != predicted.smallest;
  writer.WriteBit(turned);
  if (!turned) return;
  writer.WriteBit(state.largest == predicted.largest);
  if (state.largest != predicted.largest) return WriteOrientation(writer, quantizer, state);
  for (std::size_t i = 0; i < 3; ++i) {
    writer.WriteBanded(ZigZag(state.smallest[i] - predicted.smallest[i]), kOrientationBands);
  }
}

bool ReadDelta(BitReader& reader, const Quantizer& quantizer, const QuantizedState& base, std::uint64_t ticks,
               QuantizedState& state) {
  state = QuantizedState();
  state.asleep = reader.ReadBit();
  if (!state.asleep && !(ReadVelocity(reader, base.linear, kVelocityBands, state.linear) &&
                         ReadVelocity(reader, base.angular, kVelocityBands, state.angular))) {
    return false;
  }
  quantizer.Predict(base, ticks, state);
  if (reader.ReadBit() && !ReadPositionResidual(reader, state.position)) return false;
  return !reader.ReadBit() || ReadOrientationResidual(reader, quantizer, state);
}

}  // namespace tessera::replication
