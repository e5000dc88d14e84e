// Records of a snapshot datagram: one body's state, whole or as what its prediction from a baseline missed; one
// departure. Thread rule: free functions; any thread.
//
// The datagram, lowest bit first. `varint` is 8 bits for each 7, `banded` a prefix code (bit_stream.h; widths in
// record_codec.cpp), `zz` zigzag:
//
// clang-format off
//   header     kind 8 (1), fingerprint 16, sequence 32, tick varint, last input varint, input margin zz varint
//   departures {1, id gap banded, epoch banded, to banded}* 0
//   bodies     {1, id gap banded, (0, epoch banded, full) or (1, age, delta)}* 0
//   age        1: as the record before, or 0, ticks since the baseline less one banded
//   full       asleep 1, in bounds 1, x, y, z (of fixed widths in bounds, zz varints beyond), orientation,
//              unless asleep: linear and angular velocity, each 0: none, or 1, three zz banded
//   delta      asleep 1, unless asleep: changes of both velocities, each 0: none, or 1, three zz banded;
//              position: 0: as predicted, or 1, three zz banded residuals;
//              orientation: 0: as predicted, or 1, 1, three zz banded residuals, or 1, 0, orientation
//   orientation largest 2, three components of fixed width
//   zeros to the byte
// clang-format on
//
// Ids ascend within each list and are told as gaps, less one. Velocities come first because the prediction uses them.
#pragma once

#include <optional>

#include "absl/status/status.h"
#include "core/replication/bit_stream.h"
#include "core/replication/quantize.h"
#include "core/replication/snapshot.h"

namespace tessera::replication {

struct SnapshotHeader {
  std::uint16_t fingerprint = 0;  // Quantizer::fingerprint
  std::uint32_t sequence = 0;     // of the datagram, from 1
  Tick tick;
  std::uint32_t last_input = 0;
  std::int32_t input_margin_ticks = 0;
};

// A tick beyond this is a lie: two million years at 60 Hz. Keeps tick arithmetic far from 64 bits.
inline constexpr std::uint64_t kMaxTick = std::uint64_t{1} << 52;

void WriteHeader(BitWriter& writer, const SnapshotHeader& header);
absl::Status ReadHeader(BitReader& reader, SnapshotHeader& header);

// Ids of a list; `previous` is the one before, BodyId() at first. Reading gives nullopt where ids do not ascend.
void WriteIdGap(BitWriter& writer, BodyId previous, BodyId id);
std::optional<BodyId> ReadIdGap(BitReader& reader, BodyId previous);

void WriteDeparture(BitWriter& writer, const DepartureRecord& departure);  // without its id
bool ReadDeparture(BitReader& reader, DepartureRecord& departure);         // false beyond a range

void WriteEpoch(BitWriter& writer, Epoch epoch);
std::optional<Epoch> ReadEpoch(BitReader& reader);  // nullopt beyond 32 bits

// Ticks from a baseline to the datagram's tick. `previous`: that of the record before, 0 at first; mostly it is the
// same.
void WriteBaselineAge(BitWriter& writer, std::uint64_t age, std::uint64_t previous);
std::uint64_t ReadBaselineAge(BitReader& reader, std::uint64_t previous);

void WriteFull(BitWriter& writer, const Quantizer& quantizer, const QuantizedState& state);
void WriteDelta(BitWriter& writer, const Quantizer& quantizer, const QuantizedState& state, const QuantizedState& base,
                std::uint64_t ticks);
// False where a number is out of its range; reading past the end shows in reader.ok().
bool ReadFull(BitReader& reader, const Quantizer& quantizer, QuantizedState& state);
bool ReadDelta(BitReader& reader, const Quantizer& quantizer, const QuantizedState& base, std::uint64_t ticks,
               QuantizedState& state);

}  // namespace tessera::replication
