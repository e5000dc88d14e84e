// Records of a snapshot datagram: one body's state, whole or as what its prediction from a baseline missed; one
// departure.
//
// Datagram: header | {1 departure}* 0 | {1 body}* 0 | zeros to the byte. Ids ascend within each list and are told as
// gaps. docs/protocol.md has the layout bit by bit. Thread rule: free functions; any thread.
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
