#include "core/replication/datagram_writer.h"

#include <cassert>

namespace tessera::replication {

void DatagramWriter::Begin(const SnapshotHeader& header) {
  header_ = header;
  count_ = 0;
  Open();
}

void DatagramWriter::Open() {
  head_.Reserve(max_bits_ / 8);
  WriteHeader(head_, header_);
  if (count_ == written_.size()) written_.emplace_back();
  ++count_;
  current().bodies.clear();
  current().departures.clear();
  previous_departure_ = BodyId();
  changes_.clear();
  full_.clear();
  with_properties_.clear();
  body_bits_ = 0;
}

void DatagramWriter::Close() {
  head_.WriteBit(false);
  WriteFastList(head_, changes_);
  BodyId previous;
  for (const Pick& full : full_) {
    head_.WriteBit(true);
    WriteIdGap(head_, previous, full.id);
    full.record.AppendTo(head_);
    previous = full.id;
  }
  head_.WriteBit(false);
  previous = BodyId();
  for (const Pick& body : with_properties_) {
    head_.WriteBit(true);
    WriteIdGap(head_, previous, body.id);
    WriteProperties(head_, *body.properties);
    previous = body.id;
  }
  head_.WriteBit(false);
  assert(head_.bit_count() <= max_bits_);
  current().bytes = head_.Finish();
  ++header_.sequence;
}

void DatagramWriter::Departure(const DepartureRecord& departure) {
  assert(changes_.empty() && full_.empty());
  const auto write = [&] {
    head_.WriteBit(true);
    WriteIdGap(head_, previous_departure_, departure.id);
    WriteDeparture(head_, departure);
  };
  const BitWriter::Mark mark = head_.mark();
  write();
  if (!Fits(0)) {
    head_.Rewind(mark);
    Close();
    Open();
    write();
  }
  previous_departure_ = departure.id;
  current().departures.push_back(departure.id);
}

std::span<WrittenDatagram> DatagramWriter::Finish() {
  Close();
  return {written_.data(), count_};
}

}  // namespace tessera::replication
