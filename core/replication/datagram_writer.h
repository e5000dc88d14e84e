// DatagramWriter: packs a snapshot for one client into as few datagrams as hold it, each of which decodes alone.
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

// A body to be written.
struct Pick {
  BodyId id;
  std::uint32_t tag = 0;  // the sender's own, below kWithProperties
  SampleTicks samples;    // ticks 0: a full record
  PackedView record{};
  PackedView velocities{};            // no words: not written
  const Bytes* properties = nullptr;  // null: not written
};

// A flag in WrittenDatagram::bodies: properties were written as well.
inline constexpr std::uint32_t kWithProperties = std::uint32_t{1} << 31;

struct WrittenDatagram {
  Bytes bytes;
  std::vector<std::uint32_t> bodies;  // tags, each with kWithProperties or without
  std::vector<BodyId> departures;
};

class DatagramWriter {
 public:
  explicit DatagramWriter(std::size_t max_bytes) : max_bits_(max_bytes * 8) {}
  // `header.sequence` is that of the first datagram.
  void Begin(const SnapshotHeader& header);
  void Departure(const DepartureRecord& departure);
  void Body(const Pick& pick) {
    int bits = BitsOf(pick);
    if (!Fits(static_cast<std::size_t>(bits))) {
      Close();
      Open();
      bits = BitsOf(pick);
    }
    body_bits_ += static_cast<std::size_t>(bits);
    if (pick.samples.ticks == 0) {
      full_.push_back(pick);
    } else {
      changes_.push_back({pick.id, pick.samples, pick.record, pick.velocities});
    }
    if (pick.properties != nullptr) with_properties_.push_back(pick);
    current().bodies.push_back(pick.tag | (pick.properties != nullptr ? kWithProperties : 0));
  }
  // Gives at least one datagram: an empty one shows that the world goes on. To be moved from, before the next Begin.
  std::span<WrittenDatagram> Finish();

 private:
  void Open();
  void Close();
  // The most bits that a body adds to the datagram under way.
  int BitsOf(const Pick& pick) const {
    const int properties = pick.properties == nullptr ? 0 : 1 + kMaxIdBits + PropertyBits(pick.properties->size());
    if (pick.samples.ticks == 0) return 1 + kMaxIdBits + pick.record.bits + properties;
    const FastItem item{pick.id, pick.samples, pick.record, pick.velocities};
    return properties + (changes_.empty() ? MaxBits(item, BodyId(), {})
                                          : MaxBits(item, changes_.back().id, changes_.back().samples));
  }
  WrittenDatagram& current() { return written_[count_ - 1]; }
  bool Fits(std::size_t bits) const { return head_.bit_count() + body_bits_ + bits + kEndBits <= max_bits_; }

  // Room for the ends of the lists, and the head of the fast one.
  static constexpr std::size_t kEndBits = 3 + kMaxListBits;

  SnapshotHeader header_;
  std::size_t max_bits_;
  std::vector<WrittenDatagram> written_;
  std::size_t count_ = 0;  // so many of `written_` are in use
  // The datagram under way: its header and departures, then its bodies.
  BitWriter head_;
  BodyId previous_departure_;
  std::vector<FastItem> changes_;
  std::vector<Pick> full_, with_properties_;
  std::size_t body_bits_ = 0;
};

}  // namespace tessera::replication
