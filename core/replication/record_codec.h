// Parts of a snapshot datagram: its header, departures, and full records. Bodies that samples predict are fast records
// (codec/fast_list.h). Thread rule: free functions; any thread.
//
// The datagram, lowest bit first. `varint` is 8 bits for each 7, `b` a banded number (bit_stream.h; widths in
// record_codec.cpp), `zz` zigzag, `eg` as in codec/fast_record.h:
//
// clang-format off
//   header     kind 8 (1), fingerprint 16, sequence 32, tick varint, last input varint, input margin zz varint
//   departures {1, id gap b, epoch b, why 2, if handed over: to b}* 0
//   changes    fast list
//   full list  {1, id gap b, full}* 0
//   full       epoch eg(1), asleep 1, in bounds 1, traits 1, if there are any: jumps 8, gravity, friction and restitution,
//              each 0: the scene's, or 1, float 32, claim 0: none, or 1, player 32, command 32; x, y, z (of fixed widths in
//              bounds, eg(20) beyond), orientation, unless asleep: linear and angular velocity, each 0: none, or 1,
//              three eg(6)
//   orientation largest 2, three components of fixed width
//   properties {1, id gap b, length b, bytes}* 0: of bodies among the changes and full records (core/world/properties.h)
//   zeros to the byte
// clang-format on
//
// Ids ascend within each list and are written as gaps, less one.
#pragma once

#include <optional>

#include "absl/status/status.h"
#include "core/replication/bit_stream.h"
#include "core/replication/codec/fast_record.h"
#include "core/replication/datagram.h"
#include "core/replication/quantize.h"
#include "core/replication/snapshot_record.h"

namespace tessera::replication {

struct SnapshotHeader {
  std::uint16_t fingerprint = 0;  // Quantizer::fingerprint
  std::uint32_t sequence = 0;     // the datagram's number, from 1
  Tick tick;
  std::uint32_t last_input = 0;
  std::int32_t input_margin_ticks = 0;
};

void WriteHeader(BitWriter& writer, const SnapshotHeader& header);
absl::Status ReadHeader(BitReader& reader, SnapshotHeader& header);

// Ids of a list; `previous` is the one before, BodyId() at first. Reading gives nullopt where ids do not ascend.
void WriteIdGap(BitWriter& writer, BodyId previous, BodyId id);
std::optional<BodyId> ReadIdGap(BitReader& reader, BodyId previous);
// The most that an id takes.
inline constexpr int kMaxIdBits = 5 + 80;

void WriteDeparture(BitWriter& writer, const DepartureRecord& departure);  // without its id
bool ReadDeparture(BitReader& reader, DepartureRecord& departure);         // false beyond a range

// A full record, for a client that has no sample of the body; without its id.
PackedRecord PackFull(const Quantizer& quantizer, Epoch epoch, const QuantizedState& state, const BodyTraits& traits);
// False where a number is out of its range; reading past the end shows in reader.ok().
bool ReadFull(BitReader& reader, const Quantizer& quantizer, Epoch& epoch, QuantizedState& state, BodyTraits& traits);

void WriteProperties(BitWriter& writer, const Bytes& properties);
constexpr int PropertyBits(std::size_t bytes) { return 3 + 16 + 8 * static_cast<int>(bytes); }  // at most
bool ReadProperties(BitReader& reader, Bytes& properties);                                      // false if too long

}  // namespace tessera::replication
