// What a client says it has heard.
#include <algorithm>
#include <bit>

#include "absl/strings/str_cat.h"
#include "core/replication/snapshot_sender.h"
#include "core/world/bytes.h"

namespace tessera::replication {
namespace {

constexpr std::size_t kAckBytes = 12;
constexpr std::uint32_t kAckMaskBits = 64;
// Samples further apart than this predict nothing; they are counted in 8 bits.
constexpr std::uint64_t kMaxGap_ticks = 32;

}  // namespace

void SnapshotSender::Impl::AcknowledgeBody(std::uint32_t told, std::uint32_t sequence, Stamp tick) {
  const Busy& body = busy[told & ~kToldProperties];
  if (body.use == Busy::Use::kFree || sequence < body.first_sequence) return;
  Answered& had = busy[told & ~kToldProperties].answered;
  if ((told & kToldProperties) != 0) had.properties = std::max(had.properties, tick);
  if (tick <= had.acked) return;
  const Stamp gap = tick - had.acked;
  const bool near = had.acked != 0 && gap <= kMaxGap_ticks;
  had.unanswered = 0;
  had.gap2 = near ? had.gap : 0;
  had.gap = near ? static_cast<std::uint8_t>(gap) : 0;
  had.acked = tick;
}

void SnapshotSender::Impl::AcknowledgeOne(std::uint32_t sequence) {
  const std::uint32_t age = next_sequence - sequence;  // 1: the newest
  if (age > sent.size()) return;
  SentDatagram& datagram = sent[sent.size() - age];
  const std::vector<std::uint32_t>& told = datagram.told;
  for (const std::uint32_t place : told) __builtin_prefetch(&busy[place & ~kToldProperties], 1);
  // Before the origin: nothing that a record could refer to.
  const std::uint64_t written = datagram.tick.value();
  const Stamp tick = written >= origin ? static_cast<Stamp>(written - origin + 1) : 0;
  for (const std::uint32_t place : told) AcknowledgeBody(place, sequence, tick);
  for (const BodyId id : datagram.departures) {
    const auto at = gone.find(id);
    if (at != gone.end() && sequence >= at->second.first_sequence) gone.erase(at);
  }
  datagram.told.clear();
  datagram.departures.clear();
}

// Of the mask, what was not heard before.
std::uint64_t SnapshotSender::Impl::News(std::uint32_t newest, std::uint64_t mask) {
  if (newest < heard_newest) return mask;  // it was overtaken
  const std::uint32_t shift = newest - heard_newest;
  std::uint64_t old = shift >= kAckMaskBits ? 0 : heard_mask << shift;
  if (heard_newest != 0 && shift >= 1 && shift <= kAckMaskBits) old |= std::uint64_t{1} << (shift - 1);
  heard_newest = newest;
  heard_mask = mask;
  return mask & ~old;
}

absl::Status SnapshotSender::Impl::Acknowledge(std::uint32_t newest, std::uint64_t mask) {
  if (newest == 0 || newest >= next_sequence) {
    return absl::InvalidArgumentError(absl::StrCat("ack: sequence ", newest, " was never sent"));
  }
  const std::uint32_t age = next_sequence - newest;
  if (age <= sent.size() && told_tick.has_value()) {
    const SentDatagram& datagram = sent[sent.size() - age];
    if (!datagram.told.empty()) {
      round_trip_ticks += (static_cast<double>(*told_tick - datagram.tick) - round_trip_ticks) / 8;
    }
  }
  // Older ones first: what a body was acknowledged at only goes forward.
  for (std::uint64_t news = News(newest, mask); news != 0;) {
    const auto i = static_cast<std::uint32_t>(63 - std::countl_zero(news));
    news &= ~(std::uint64_t{1} << i);
    if (i + 1 < newest) AcknowledgeOne(newest - 1 - i);
  }
  AcknowledgeOne(newest);
  // What is older can be acknowledged no more.
  while (sent.size() > age + kAckMaskBits) ForgetOldest();
  return absl::OkStatus();
}

absl::Status SnapshotSender::Acknowledge(std::span<const std::uint8_t> ack) {
  if (ack.empty()) return absl::OkStatus();  // nothing has come yet
  if (ack.size() != kAckBytes) {
    return absl::InvalidArgumentError(absl::StrCat("ack: ", ack.size(), " bytes instead of ", kAckBytes));
  }
  ByteReader in(ack);
  const std::uint32_t newest = in.U32();
  return impl_->Acknowledge(newest, in.U64());
}

}  // namespace tessera::replication
