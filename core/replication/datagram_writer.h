// DatagramWriter: puts what a client is to be told into as few datagrams as hold it, each of which decodes alone.
//
//   DatagramWriter writer(header, max_bytes);
//   for (departures, ascending by id) writer.Departure(record);
//   for (bodies, ascending by id) writer.Body(pick);
//   for (WrittenDatagram& datagram : writer.Finish()) ...
//
// Thread rule: one thread at a time; what picks point to stays where it is until Finish.
#pragma once

#include <vector>

#include "core/replication/codec/fast_list.h"
#include "core/replication/record_codec.h"

namespace tessera::replication {

// A body to be told.
struct Pick {
  BodyId id;
  std::uint32_t known = 0;  // the sender's own
  SampleTicks samples;      // ticks 0: whole
  const PackedRecord* record = nullptr;
  const PackedRecord* velocities = nullptr;  // null: not told
};

struct WrittenDatagram {
  Bytes bytes;
  std::vector<std::uint32_t> known;  // of the bodies in it
  std::vector<BodyId> departures;
};

class DatagramWriter {
 public:
  // `header.sequence` is that of the first datagram.
  DatagramWriter(const SnapshotHeader& header, std::size_t max_bytes) : header_(header), max_bits_(max_bytes * 8) {
    Open();
  }
  void Departure(const DepartureRecord& departure);
  void Body(const Pick& pick);
  // At least one: it says that the world goes on.
  std::vector<WrittenDatagram> Finish();

 private:
  void Open();
  void Close();
  bool Fits(std::size_t bits) const { return head_.bit_count() + body_bits_ + bits + kEndBits <= max_bits_; }

  // The ends of the lists, and the head of the fast one.
  static constexpr std::size_t kEndBits = 2 + kMaxListBits;

  SnapshotHeader header_;
  std::size_t max_bits_;
  std::vector<WrittenDatagram> written_;
  // Of the datagram under way:
  BitWriter head_;  // header and departures
  BodyId previous_departure_;
  std::vector<FastItem> changes_;
  std::vector<Pick> wholes_;
  std::size_t body_bits_ = 0;
};

}  // namespace tessera::replication
