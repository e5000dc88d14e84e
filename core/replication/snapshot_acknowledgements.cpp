// A client's acknowledgements: by them the sender knows which state of each body the client has.
#include <algorithm>
#include <bit>
#include <cstdint>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/replication/datagram.h"
#include "core/replication/snapshot_sender_impl.h"

namespace tessera::replication {
namespace {

// Largest gap between two samples that predict a body; Acknowledged counts it in 8 bits.
constexpr std::uint64_t kMaxGap_ticks = 32;

}  // namespace

void SnapshotSender::Impl::AcknowledgeBody(std::uint32_t body, std::uint32_t sequence, Stamp tick) {
  DirtyEntity& entity = dirty[body & ~kWithProperties];
  if (entity.use == DirtyEntity::Use::kFree || sequence < entity.first_sequence) return;
  Acknowledged& had = entity.acknowledged;
  if ((body & kWithProperties) != 0) had.properties = std::max(had.properties, tick);
  if (tick <= had.tick) return;
  const Stamp gap = tick - had.tick;
  const bool near = had.tick != 0 && gap <= kMaxGap_ticks;
  had.unanswered = 0;
  had.gap2 = near ? had.gap : 0;
  had.gap = near ? static_cast<std::uint8_t>(gap) : 0;
  had.tick = tick;
}

void SnapshotSender::Impl::AcknowledgeDatagram(std::uint32_t sequence) {
  const std::uint32_t age = next_sequence - sequence;  // 1: the newest
  if (age > sent.size()) return;
  SentDatagram& datagram = sent[sent.size() - age];
  for (const std::uint32_t body : datagram.bodies) __builtin_prefetch(&dirty[body & ~kWithProperties], 1);
  // No record can refer to a tick before the origin.
  const std::uint64_t written = datagram.tick.value();
  const Stamp tick = written >= origin ? static_cast<Stamp>(written - origin + 1) : 0;
  for (const std::uint32_t body : datagram.bodies) AcknowledgeBody(body, sequence, tick);
  for (const BodyId id : datagram.departures) {
    const auto at = pending_departures.find(id);
    if (at != pending_departures.end() && sequence >= at->second.first_sequence) pending_departures.erase(at);
  }
  datagram.bodies.clear();
  datagram.departures.clear();
}

// The bits of the mask that no earlier acknowledgement had.
std::uint64_t SnapshotSender::Impl::NewlyAcknowledged(std::uint32_t newest, std::uint64_t mask) {
  if (newest < acknowledged_newest) return mask;  // it was overtaken
  const std::uint32_t shift = newest - acknowledged_newest;
  std::uint64_t old = shift >= kAckMaskBits ? 0 : acknowledged_mask << shift;
  if (acknowledged_newest != 0 && shift >= 1 && shift <= kAckMaskBits) old |= std::uint64_t{1} << (shift - 1);
  acknowledged_newest = newest;
  acknowledged_mask = mask;
  return mask & ~old;
}

absl::Status SnapshotSender::Impl::Acknowledge(std::uint32_t newest, std::uint64_t mask) {
  if (newest == 0 || newest >= next_sequence) {
    return absl::InvalidArgumentError(absl::StrCat("ack: sequence ", newest, " was never sent"));
  }
  const std::uint32_t age = next_sequence - newest;
  if (age <= sent.size() && sent_tick.has_value()) {
    const SentDatagram& datagram = sent[sent.size() - age];
    if (!datagram.bodies.empty()) {
      round_trip_ticks += (static_cast<double>(*sent_tick - datagram.tick) - round_trip_ticks) / 8;
    }
  }
  // Older datagrams first: the acknowledged tick of a body only goes forward.
  for (std::uint64_t left = NewlyAcknowledged(newest, mask); left != 0;) {
    const auto i = static_cast<std::uint32_t>(63 - std::countl_zero(left));
    left &= ~(std::uint64_t{1} << i);
    if (i + 1 < newest) AcknowledgeDatagram(newest - 1 - i);
  }
  AcknowledgeDatagram(newest);
  // Older datagrams can be acknowledged no more.
  while (sent.size() > age + kAckMaskBits) ForgetOldest();
  return absl::OkStatus();
}

}  // namespace tessera::replication
