#include <algorithm>
#include <cassert>
#include <deque>
#include <optional>

#include "absl/strings/str_cat.h"
#include "core/replication/record_codec.h"
#include "core/replication/snapshot_history.h"

namespace tessera::replication {
namespace {

constexpr std::size_t kAckBytes = 12;
constexpr std::uint32_t kAckMaskBits = 64;

// What the client was told of a body.
struct Known {
  BodyId id;
  Epoch epoch;  // of the ownership; when `gone`, of the one that ended
  Tick first;   // tick at which this was told first: acknowledgements of older datagrams are about something else
  std::optional<Tick> acked;
  bool gone = false, forget = false;
  RegionId to;  // when gone
};

struct SentDatagram {
  Tick tick;
  std::vector<BodyId> bodies, departures;  // ascending
};

// Writes the datagrams of one snapshot: opens, fills, closes them.
class DatagramWriter {
 public:
  DatagramWriter(const SnapshotHeader& header, std::size_t max_bytes, std::vector<Bytes>& datagrams,
                 std::deque<SentDatagram>& sent)
      : header_(header), max_bits_(max_bytes * 8), datagrams_(datagrams), sent_(sent) {
    Open();
  }
  // The sequence of the next snapshot's first datagram.
  std::uint32_t Close() {
    if (!in_bodies_) writer_.WriteBit(false);
    writer_.WriteBit(false);
    datagrams_.push_back(writer_.Finish());
    return header_.sequence + 1;
  }
  void Departure(const DepartureRecord& departure) {
    assert(!in_bodies_);
    const auto write = [&] {
      writer_.WriteBit(true);
      WriteIdGap(writer_, previous_, departure.id);
      WriteDeparture(writer_, departure);
    };
    Record(departure.id, write);
    sent_.back().departures.push_back(departure.id);
  }
  void BeginBodies() {
    if (in_bodies_) return;
    writer_.WriteBit(false);
    in_bodies_ = true;
    previous_ = BodyId();
  }
  // `base` with its tick, or nothing.
  void Body(const Quantizer& quantizer, const HistoryItem& item, const QuantizedState* base, Tick base_tick) {
    const auto write = [&] {
      writer_.WriteBit(true);
      WriteIdGap(writer_, previous_, item.id);
      writer_.WriteBit(base != nullptr);
      if (base == nullptr) {
        WriteEpoch(writer_, item.epoch);
        return WriteFull(writer_, quantizer, item.state);
      }
      const auto ticks = static_cast<std::uint64_t>(header_.tick - base_tick);
      WriteBaselineAge(writer_, ticks, previous_age_);
      WriteDelta(writer_, quantizer, item.state, *base, ticks);
    };
    Record(item.id, write);
    if (base != nullptr) previous_age_ = static_cast<std::uint64_t>(header_.tick - base_tick);
    sent_.back().bodies.push_back(item.id);
  }

 private:
  template <class Write>
  void Record(BodyId id, const Write& write) {
    constexpr std::size_t kEndBits = 2;
    const BitWriter::Mark mark = writer_.mark();
    write();
    if (writer_.bit_count() + kEndBits > max_bits_) {
      const bool in_bodies = in_bodies_;
      writer_.Rewind(mark);
      header_.sequence = Close();
      Open();
      if (in_bodies) BeginBodies();
      write();
      assert(writer_.bit_count() + kEndBits <= max_bits_);
    }
    previous_ = id;
  }
  void Open() {
    WriteHeader(writer_, header_);
    sent_.push_back({.tick = header_.tick, .bodies = {}, .departures = {}});
    in_bodies_ = false;
    previous_ = BodyId();
    previous_age_ = 0;
  }

  SnapshotHeader header_;
  std::size_t max_bits_;
  std::vector<Bytes>& datagrams_;
  std::deque<SentDatagram>& sent_;
  BitWriter writer_;
  bool in_bodies_ = false;
  BodyId previous_;
  std::uint64_t previous_age_ = 0;
};

}  // namespace

struct SnapshotSender::Impl {
  using History = SnapshotHistory::Impl;
  struct Baseline {
    const QuantizedState* state = nullptr;
    Tick tick;
  };

  explicit Impl(const Settings& settings_in) : settings(settings_in) {}

  void MergeKnown(const History& history);
  Baseline FindBaseline(const History& history, const Known& body);
  const HistoryItem* FindItem(const HistoryEntry& entry, std::size_t slot, BodyId id);
  std::size_t AgeOf(const History& history, Tick tick) const;
  void ForgetOldDatagrams(const History& history);
  // Nothing has changed that the client does not have, and it has heard of the world not long ago.
  bool NothingToTell(const HistoryEntry& newest, std::uint32_t last_input, std::int32_t input_margin_ticks) const;
  void AcknowledgeOne(std::uint32_t sequence);

  Settings settings;
  std::vector<Known> known, merged;  // ascending by id
  std::deque<SentDatagram> sent;     // the last one has the sequence next_sequence - 1
  std::uint32_t next_sequence = 1;
  // Of the datagram written last.
  std::optional<Tick> told_tick;
  std::uint32_t told_input = 0;
  std::int32_t told_margin = 0;
  std::vector<std::size_t> cursors;  // by slot of the history: bodies are looked up in ascending order
};

// Brings `known` up to the newest tick: bodies that appeared, came back under another epoch, left, or are to be
// forgotten.
void SnapshotSender::Impl::MergeKnown(const History& history) {
  const HistoryEntry& newest = history.newest();
  merged.clear();
  merged.reserve(newest.items.size());
  auto old = known.begin();
  const auto keep_absent = [&] {
    if (old->forget) return;
    if (!old->gone) {
      const auto departure = history.departed.find(old->id);
      const bool found = departure != history.departed.end();
      *old = {.id = old->id,
              .epoch = found ? departure->second.epoch : old->epoch,
              .first = newest.tick,
              .acked = {},
              .gone = true,
              .to = found ? departure->second.to : RegionId()};
    }
    merged.push_back(*old);
  };
  for (const HistoryItem& item : newest.items) {
    for (; old != known.end() && old->id < item.id; ++old) keep_absent();
    const bool present = old != known.end() && old->id == item.id;
    if (present && !old->gone && old->epoch == item.epoch) {
      merged.push_back(*old);
    } else {
      merged.push_back({.id = item.id, .epoch = item.epoch, .first = newest.tick, .acked = {}, .to = {}});
    }
    if (present) ++old;
  }
  for (; old != known.end(); ++old) keep_absent();
  known.swap(merged);
}

// Of the entry with this tick; of the oldest one where that has left.
std::size_t SnapshotSender::Impl::AgeOf(const History& history, Tick tick) const {
  std::size_t age = 0;
  while (age + 1 < history.count && history.ring[history.SlotAt(age)].tick > tick) ++age;
  return age;
}

const HistoryItem* SnapshotSender::Impl::FindItem(const HistoryEntry& entry, std::size_t slot, BodyId id) {
  std::size_t& cursor = cursors[slot];
  while (cursor < entry.items.size() && entry.items[cursor].id < id) ++cursor;
  return cursor < entry.items.size() && entry.items[cursor].id == id ? &entry.items[cursor] : nullptr;
}

SnapshotSender::Impl::Baseline SnapshotSender::Impl::FindBaseline(const History& history, const Known& body) {
  if (!body.acked.has_value()) return {};
  const std::size_t slot = history.SlotAt(AgeOf(history, *body.acked));
  const HistoryEntry& entry = history.ring[slot];
  const HistoryItem* item = FindItem(entry, slot, body.id);
  if (item == nullptr || item->epoch != body.epoch) return {};
  // Either the very tick, or one after it up to which nothing had changed: a body that wakes after a long rest.
  if (entry.tick != *body.acked && !(entry.tick > *body.acked && item->since <= *body.acked)) return {};
  return {&item->state, *body.acked};
}

void SnapshotSender::Impl::ForgetOldDatagrams(const History& history) {
  while (!sent.empty() && sent.front().tick < history.oldest_tick()) sent.pop_front();
}

bool SnapshotSender::Impl::NothingToTell(const HistoryEntry& newest, std::uint32_t last_input,
                                         std::int32_t input_margin_ticks) const {
  if (!told_tick.has_value() || newest.tick >= *told_tick + settings.idle_ticks) return false;
  if (last_input != told_input || input_margin_ticks != told_margin) return false;
  auto item = newest.items.begin();
  return std::all_of(known.begin(), known.end(), [&](const Known& body) {
    return !body.gone && body.acked.has_value() && *body.acked >= item++->since;
  });
}

void SnapshotSender::Impl::AcknowledgeOne(std::uint32_t sequence) {
  const std::uint32_t age = next_sequence - sequence;  // 1: the newest
  if (age > sent.size()) return;
  SentDatagram& datagram = sent[sent.size() - age];
  auto body = known.begin();
  const auto find = [&](BodyId id) {
    body = std::lower_bound(body, known.end(), id, [](const Known& a, BodyId b) { return a.id < b; });
    return body != known.end() && body->id == id && datagram.tick >= body->first;
  };
  for (const BodyId id : datagram.bodies) {
    if (find(id) && !body->gone && (!body->acked.has_value() || *body->acked < datagram.tick)) {
      body->acked = datagram.tick;
    }
  }
  body = known.begin();
  for (const BodyId id : datagram.departures) {
    if (find(id) && body->gone) body->forget = true;
  }
  datagram.bodies = {};  // once is enough: gives the memory back
  datagram.departures = {};
}

SnapshotSender::SnapshotSender(const Settings& settings) : impl_(std::make_unique<Impl>(settings)) {}
SnapshotSender::~SnapshotSender() = default;
SnapshotSender::SnapshotSender(SnapshotSender&&) noexcept = default;
SnapshotSender& SnapshotSender::operator=(SnapshotSender&&) noexcept = default;

WrittenSnapshot SnapshotSender::Write(const SnapshotHistory& shared, std::uint32_t last_input,
                                      std::int32_t input_margin_ticks) {
  const SnapshotHistory::Impl& history = *shared.impl_;
  assert(!history.empty());
  Impl& sender = *impl_;
  sender.ForgetOldDatagrams(history);
  sender.MergeKnown(history);
  sender.cursors.assign(history.ring.size(), 0);

  WrittenSnapshot result;
  const HistoryEntry& newest = history.newest();
  if (sender.NothingToTell(newest, last_input, input_margin_ticks)) return result;
  sender.told_tick = newest.tick;
  sender.told_input = last_input;
  sender.told_margin = input_margin_ticks;
  DatagramWriter writer({.fingerprint = history.quantizer.fingerprint(),
                         .sequence = sender.next_sequence,
                         .tick = newest.tick,
                         .last_input = last_input,
                         .input_margin_ticks = input_margin_ticks},
                        sender.settings.max_datagram_bytes, result.datagrams, sender.sent);
  for (const Known& body : sender.known) {
    if (body.gone) writer.Departure({body.id, body.epoch, body.to});
  }
  writer.BeginBodies();
  auto item = newest.items.begin();
  std::uint32_t whole = 0;
  for (const Known& body : sender.known) {
    if (body.gone) continue;
    assert(item->id == body.id);
    const HistoryItem& now = *item++;
    if (body.acked.has_value() && *body.acked >= now.since) continue;  // the client has this very state
    const Impl::Baseline base = sender.FindBaseline(history, body);
    writer.Body(history.quantizer, now, base.state, base.tick);
    whole += base.state == nullptr;
    ++result.bodies;
  }
  result.full = whole > 0 && whole == result.bodies;
  sender.next_sequence = writer.Close();
  return result;
}

absl::Status SnapshotSender::Acknowledge(std::span<const std::uint8_t> ack) {
  if (ack.empty()) return absl::OkStatus();  // nothing has come yet
  if (ack.size() != kAckBytes) {
    return absl::InvalidArgumentError(absl::StrCat("ack: ", ack.size(), " bytes instead of ", kAckBytes));
  }
  BitReader reader(ack);
  const auto newest = static_cast<std::uint32_t>(reader.Read(32));
  const std::uint64_t mask = reader.Read(64);
  if (newest == 0 || newest >= impl_->next_sequence) {
    return absl::InvalidArgumentError(absl::StrCat("ack: sequence ", newest, " was never sent"));
  }
  impl_->AcknowledgeOne(newest);
  for (std::uint32_t i = 0; i < kAckMaskBits && i + 1 < newest; ++i) {
    if ((mask >> i & 1) != 0) impl_->AcknowledgeOne(newest - 1 - i);
  }
  return absl::OkStatus();
}

}  // namespace tessera::replication
