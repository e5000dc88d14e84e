// DatagramWriter: puts what a client is to be told into as few datagrams as hold it, each of which decodes alone.
//
//   DatagramWriter writer(max_bytes);
//   writer.Begin(header);                                        // and again for the next: it keeps its room
//   for (departures, ascending by id) writer.Departure(record);
//   for (bodies, ascending by id) writer.Body(pick);
//   for (WrittenDatagram& datagram : writer.Finish()) ...
//
// Thread rule: one thread at a time; what picks point to stays where it is until Finish.
#pragma once

#include <span>
#include <vector>

#include "core/replication/codec/fast_list.h"
#include "core/replication/record_codec.h"

namespace tessera::replication {

// A body to be told.
struct Pick {
  BodyId id;
  std::uint32_t known = 0;  // the sender's own
  SampleTicks samples;      // ticks 0: whole
  PackedView record{};
  PackedView velocities{};            // no words: not told
  const Bytes* properties = nullptr;  // null: not told
};

// In WrittenDatagram::known: properties were told as well.
inline constexpr std::uint32_t kToldProperties = std::uint32_t{1} << 31;

struct WrittenDatagram {
  Bytes bytes;
  std::vector<std::uint32_t> known;  // of the bodies in it
  std::vector<BodyId> departures;
};

class DatagramWriter {
 public:
  explicit DatagramWriter(std::size_t max_bytes) : max_bits_(max_bytes * 8) {}
  // `header.sequence` is that of the first datagram.
  void Begin(const SnapshotHeader& header);
  void Departure(const DepartureRecord& departure);
  void Body(const Pick& pick);
  // At least one: it says that the world goes on. To be moved from, before the next Begin.
  std::span<WrittenDatagram> Finish();

 private:
  void Open();
  void Close();
  WrittenDatagram& current() { return written_[count_ - 1]; }
  bool Fits(std::size_t bits) const { return head_.bit_count() + body_bits_ + bits + kEndBits <= max_bits_; }

  // The ends of the lists, and the head of the fast one.
  static constexpr std::size_t kEndBits = 3 + kMaxListBits;

  SnapshotHeader header_;
  std::size_t max_bits_;
  std::vector<WrittenDatagram> written_;
  std::size_t count_ = 0;  // of `written_` that are in use
  // Of the datagram under way:
  BitWriter head_;  // header and departures
  BodyId previous_departure_;
  std::vector<FastItem> changes_;
  std::vector<Pick> wholes_, propertied_;
  std::size_t body_bits_ = 0;
};

}  // namespace tessera::replication
