#include "core/region/message_relay.h"

#include <algorithm>
#include <limits>

namespace tessera::region {
namespace {

using game::HeldMessage;
using game::Mail;
using game::SentMessage;

// A message is sent again after so many ticks without an acknowledgement, later after twice as many and so on.
constexpr std::uint64_t kRepeatTicks = 30, kLongestRepeatTicks = 480;
// After so many ticks its target counts as gone: ten minutes at 60 ticks a second.
constexpr std::uint64_t kGiveUpTicks = 36'000;
// Records elsewhere whose places are remembered.
constexpr std::size_t kMaxPlaces = 8'192;
// A body that went on so few ticks ago may have been missed by a packet that went to all regions.
constexpr std::uint64_t kRecentTicks = 16;
// For so many ticks it is known where a body came from.
constexpr std::uint64_t kCameTicks = 2 * game::kTransitTicks;
// The properties of the world are sent again so often, for regions that missed them.
constexpr std::uint64_t kInstanceTicks = 60;

// Regions whose links are up differ by a few ticks.
bool OutOfTime(const MessagePacket& packet, Tick now) {
  return packet.sent + game::kTransitTicks < now || packet.sent > now + game::kTransitTicks;
}

MessagePacket AnswerTo(const MessagePacket& packet, PacketKind kind, std::uint64_t number) {
  MessagePacket answer;
  answer.kind = kind;
  answer.from = packet.to;
  answer.to = packet.from;
  answer.number = number;
  answer.via = packet.origin;
  return answer;
}

}  // namespace

// --- The beginning of a step

void MessageRelay::HandedOver(BodyId id, RegionId to, Tick now) {
  if (catalog_.has_game()) places_[id] = {to, now};
}

void MessageRelay::TakenIn(BodyId id, RegionId from, Tick now) {
  if (!catalog_.has_game()) return;
  places_.erase(id);
  came_from_[id] = {from, now};
  const KeptRecord* record = records_.Find(id);
  if (record == nullptr || record->game.mail.senders.empty()) return;
  Packet packet;
  packet.kind = PacketKind::kPlace;
  packet.from = id;
  packet.number = bodies_.EpochOf(id).value();
  Emit(std::move(packet), now);
}

void MessageRelay::Receive(RegionId from, std::span<const MessagePacket> packets, Tick now) {
  if (packets.empty()) return;
  routes_.Adopt(neighborhood_.map());
  for (const MessagePacket& packet : packets) {
    if (packet.kind == PacketKind::kBlast) continue;  // blast_table.h
    if (!OutOfTime(packet, now)) Route(packet, from, now);
  }
}

// Questions and answers go from region to region, and are asked anew where they are lost.
void MessageRelay::RouteQuestion(const Packet& packet, Tick now) {
  if (packet.via != self()) {
    ++statistics_.forwarded;
    return Direct(packet);
  }
  if (const std::optional<Packet> answer = questions_.Take(packet, now)) Direct(*answer);
}

void MessageRelay::Route(Packet packet, RegionId from, Tick now) {
  if (packet.kind == PacketKind::kQuestion || packet.kind == PacketKind::kAnswer) return RouteQuestion(packet, now);
  if (packet.kind == PacketKind::kInstance) TakeInstance(packet);
  if (packet.kind == PacketKind::kPlace) NotePlace(packet.from, packet.origin, now);
  if (packet.to != BodyId() && TakeHere(packet, now)) return;
  if (packet.via == RegionId() || packet.via == self()) {
    // Where a body has gone on just now, its new region may have passed a packet to all on before it came.
    const auto place = places_.find(packet.to);
    const bool known = place != places_.end() && place->second.region != self();
    const bool recent = known && place->second.since + kRecentTicks >= now;
    if (packet.via == self()) {
      packet.via = known ? place->second.region : RegionId();  // it may have gone back to where the packet came from
    } else if (recent) {
      Packet copy = packet;
      copy.via = place->second.region;
      Direct(copy);
    }
  }
  if (packet.via == RegionId()) {
    Flood(packet, from);
  } else {
    ++statistics_.forwarded;
    Direct(packet);
  }
}

void MessageRelay::Flood(const Packet& packet, RegionId from) {
  const FloodKey key(packet.kind, packet.from, packet.to, packet.number, packet.origin, packet.sent);
  if (!flooded_[packet.sent].insert(key).second) return;
  for (const RegionId neighbor : neighborhood_.neighbors()) {
    if (neighbor == from || !borders_.IsUp(neighbor)) continue;
    outgoing_.Add(neighbor, packet);
    ++statistics_.forwarded;
  }
}

void MessageRelay::Direct(const Packet& packet) {
  const auto up = [this](RegionId neighbor) { return borders_.IsUp(neighbor); };
  const RegionId next = routes_.NextHop(self(), packet.via, up);
  if (next != RegionId()) outgoing_.Add(next, packet);
}

void MessageRelay::Emit(Packet packet, Tick now) {
  // An answer may leave after the record that it speaks for: it tells where that went.
  const auto moved = bodies_.Owns(packet.from) ? places_.end() : places_.find(packet.from);
  packet.origin = moved == places_.end() ? self() : moved->second.region;
  packet.sent = now;
  if (packet.to != BodyId() && TakeHere(packet, now)) return;
  if (packet.via == self()) packet.via = RegionId();
  if (packet.via == RegionId()) {
    Flood(packet, RegionId());
  } else {
    Direct(packet);
  }
}

void MessageRelay::Later(Packet packet, Tick since) { later_.emplace_back(since, std::move(packet)); }

RegionId MessageRelay::WhereIs(BodyId id) const {
  if (const Ghost* ghost = bodies_.FindGhost(id); ghost != nullptr) return ghost->owner;
  if (const auto place = places_.find(id); place != places_.end()) return place->second.region;
  return id == kInstanceBody ? neighborhood_.map().OwnerOf(catalog_.InstancePlace()) : RegionId();
}

void MessageRelay::NotePlace(BodyId id, RegionId region, Tick now) {
  if (region == self() || bodies_.Owns(id)) return;
  places_[id] = {region, now > Tick(kRecentTicks) ? Tick(now.value() - kRecentTicks - 1) : Tick()};
  if (places_.size() > kMaxPlaces) places_.clear();
}

// --- Packets for a record here

bool MessageRelay::TakeHere(const Packet& packet, Tick now) {
  if (!bodies_.Owns(packet.to)) {
    if (!tombstones_.Has(packet.to)) return false;
    AnswerForRemoved(packet, now);
    return true;
  }
  NotePlace(packet.from, packet.origin, now);
  switch (packet.kind) {
    case PacketKind::kMessage:
      TakeMessage(packet, now);
      break;
    case PacketKind::kAcknowledged:
      TakeAcknowledgement(packet, now);
      break;
    case PacketKind::kConfirmed:
      TakeConfirmation(packet, now);
      break;
    case PacketKind::kGone:
      DropTo(packet.to, packet.from);
      break;
    case PacketKind::kInstance:
    case PacketKind::kPlace:
    case PacketKind::kQuestion:
    case PacketKind::kAnswer:
    case PacketKind::kBlast:
      break;
  }
  EndIfDone(packet.to, now);
  return true;
}

void MessageRelay::AnswerForRemoved(const Packet& packet, Tick now) {
  if (packet.kind == PacketKind::kMessage) {
    Later(AnswerTo(packet, PacketKind::kGone, packet.number), now);
  } else if (packet.kind == PacketKind::kAcknowledged) {
    Later(AnswerTo(packet, PacketKind::kConfirmed, std::numeric_limits<std::uint64_t>::max()), now);
  }
}

template <class Change>
void MessageRelay::ChangeMail(BodyId id, const Change& change) {
  const KeptRecord* record = records_.Find(id);
  game::GameRecord changed = record == nullptr ? game::GameRecord() : record->game;
  if (change(changed.mail)) records_.Put(id, changed);
}

void MessageRelay::TakeMessage(const Packet& packet, Tick now) {
  const KeptRecord* record = records_.Find(packet.to);
  if (record != nullptr && record->game.removed) return AnswerForRemoved(packet, now);
  // The way is measured to where the target was when the message was made: that is the same in each run.
  const auto came = came_from_.find(packet.to);
  const bool moved = came != came_from_.end() && came->second.since > packet.made;
  const RegionId target_region = moved ? came->second.region : self();
  HeldMessage held;
  held.sender = packet.from;
  held.number = packet.number;
  held.after = packet.after;
  held.made = packet.made;
  held.hops = std::max<std::uint32_t>(1, routes_.Distance(packet.made_in, target_region).value_or(1));
  held.due = packet.made + game::DeliveryTicks(held.hops);
  held.what = packet.what;
  auto arrival = Mail::Arrival::kNew;
  ChangeMail(packet.to, [&](Mail& mail) {
    arrival = mail.Take(std::move(held), now);
    return arrival == Mail::Arrival::kNew;
  });
  if (arrival == Mail::Arrival::kRefused) return;
  if (arrival == Mail::Arrival::kRepeated) ++statistics_.copies;
  Later(AnswerTo(packet, PacketKind::kAcknowledged, packet.number), now);
}

void MessageRelay::TakeAcknowledgement(const Packet& packet, Tick now) {
  bool waited = false;
  ChangeMail(packet.to, [&](Mail& mail) { return waited = mail.Acknowledged(packet.from, packet.number); });
  if (waited) return;
  const KeptRecord* record = records_.Find(packet.to);
  if (record != nullptr && !record->game.mail.Settled(packet.from, packet.number)) return;
  Later(AnswerTo(packet, PacketKind::kConfirmed, packet.number), now);
}

void MessageRelay::TakeConfirmation(const Packet& packet, Tick now) {
  ChangeMail(packet.to, [&](Mail& mail) { return mail.Confirmed(packet.from, packet.number, now); });
}

void MessageRelay::DropTo(BodyId sender, BodyId target) {
  ChangeMail(sender, [&](Mail& mail) {
    const std::size_t dropped = mail.DropTo(target);
    statistics_.refused += dropped;
    return dropped > 0;
  });
}

void MessageRelay::EndIfDone(BodyId id, Tick now) {
  const KeptRecord* record = records_.Find(id);
  if (record == nullptr || !record->game.removed || !record->game.mail.outbox.empty()) return;
  const Epoch epoch = ownership_.RemoveBodiless(id);
  tombstones_.Add(id, epoch, now);
}

// --- The end of a step

void MessageRelay::Send(Tick now, std::optional<Tick> standby_has) {
  if (!catalog_.has_game()) return;
  routes_.Adopt(neighborhood_.map());
  waits_ = false;
  for (const Packet& question : questions_.Ask(now)) Direct(question);
  PublishInstance(now);
  SendOutboxes(now, standby_has);
  Remind(now);
  std::vector<std::pair<Tick, Packet>> later = std::exchange(later_, {});
  for (auto& [since, packet] : later) {
    if (standby_has.has_value() && since > *standby_has) {
      later_.emplace_back(since, std::move(packet));
    } else {
      Emit(std::move(packet), now);
    }
  }
  waits_ = waits_ || !later_.empty();
  ForgetOld(now);
}

void MessageRelay::SendOutboxes(Tick now, std::optional<Tick> standby_has) {
  decltype(attempts_) before = std::exchange(attempts_, {});
  const std::vector<BodyId> senders(records_.mailing().begin(), records_.mailing().end());
  for (const BodyId id : senders) {
    const KeptRecord* record = records_.Find(id);
    if (record == nullptr || record->game.mail.outbox.empty()) continue;
    const std::vector<SentMessage> outbox = record->game.mail.outbox;
    for (const SentMessage& message : outbox) {
      if (message.made + kGiveUpTicks < now) {
        DropTo(id, message.target);
        continue;
      }
      if (standby_has.has_value() && message.made > *standby_has) {
        waits_ = true;
        continue;
      }
      const auto tried = before.find({id, message.number});
      Attempt attempt = tried == before.end() ? Attempt{now, 0} : tried->second;
      if (attempt.next <= now) {
        Packet packet;
        packet.from = id;
        packet.to = message.target;
        packet.number = message.number;
        packet.made = message.made;
        packet.made_in = message.made_in;
        packet.after = message.after;
        packet.what = message.what;
        if (attempt.times == 0) packet.via = WhereIs(message.target);
        ++(attempt.times == 0 ? statistics_.sent : statistics_.repeated);
        attempt.next =
            now + std::min(kRepeatTicks << std::min<std::uint32_t>(attempt.times / 2, 4), kLongestRepeatTicks);
        ++attempt.times;
        Emit(std::move(packet), now);
      }
      attempts_.emplace(std::pair(id, message.number), attempt);
    }
    EndIfDone(id, now);
  }
}

// Senders that this region's records remember are asked whether they still need to be.
void MessageRelay::Remind(Tick now) {
  const std::vector<BodyId> targets(records_.mailing().begin(), records_.mailing().end());
  for (const BodyId id : targets) {
    const Mail& mail = records_.Find(id)->game.mail;
    for (const Mail::Sender& sender : mail.senders) {
      if (!Mail::RemindIn(sender, now)) continue;
      Packet packet;
      packet.kind = PacketKind::kAcknowledged;
      packet.from = id;
      packet.to = sender.id;
      packet.number = sender.applied;
      packet.via = WhereIs(sender.id);
      Later(std::move(packet), now);
    }
    if (mail.ForgetsBy(now)) ChangeMail(id, [now](Mail& changed) { return changed.Forget(now); });
  }
}

void MessageRelay::ForgetOld(Tick now) {
  while (!flooded_.empty() && flooded_.begin()->first + game::kTransitTicks < now) flooded_.erase(flooded_.begin());
  if (now.value() % kInstanceTicks != 0) return;
  std::erase_if(came_from_, [now](const auto& entry) { return entry.second.since + kCameTicks < now; });
}

void MessageRelay::Restart() {
  later_.clear();
  attempts_.clear();
  places_.clear();
  came_from_.clear();
  flooded_.clear();
  published_ = nullptr;
}

// --- The properties of the world

void MessageRelay::BeginWith(const std::vector<std::uint8_t>& instance_properties) {
  instance_.push_front({Epoch(), Tick(), Tick(), instance_properties});
}

void MessageRelay::PublishInstance(Tick now) {
  const OwnedBody* instance = bodies_.FindBodiless(kInstanceBody);
  if (instance == nullptr || catalog_.scene().instance_properties.empty()) return;
  const KeptRecord* record = records_.Find(kInstanceBody);
  static const auto kNone = std::make_shared<const std::vector<std::uint8_t>>();
  const auto& bytes = record == nullptr ? kNone : record->bytes;
  const bool changed = published_ != bytes || published_epoch_ != instance->epoch;
  if (!changed && now.value() % kInstanceTicks != 0) return;
  if (changed) {
    published_ = bytes;
    published_epoch_ = instance->epoch;
    published_at_ = now;
  }
  Packet packet;
  packet.kind = PacketKind::kInstance;
  packet.from = kInstanceBody;
  packet.number = instance->epoch.value();
  packet.made = published_at_;
  packet.made_in = self();
  packet.properties = *bytes;
  TakeInstance(packet);
  Later(std::move(packet), published_at_);
}

void MessageRelay::TakeInstance(const Packet& packet) {
  const Epoch epoch(static_cast<std::uint32_t>(packet.number));
  const std::uint32_t hops = routes_.Distance(packet.made_in, self()).value_or(1);
  const auto order = [](const InstanceVersion& version) { return std::pair(version.epoch, version.made); };
  const auto at = std::ranges::lower_bound(instance_, std::pair(epoch, packet.made), {}, order);
  if (at != instance_.end() && order(*at) == std::pair(epoch, packet.made)) return;
  const Tick seen = packet.made + game::DeliveryTicks(hops);
  instance_.insert(at, {epoch, packet.made, seen, packet.properties, packet.made_in == self()});
  // A version older than the newest that is seen by now is not needed; a few that are not seen yet are.
  constexpr std::size_t kMostVersions = 64;
  if (instance_.size() > kMostVersions) instance_.pop_front();
}

// Another region's have come here because its standby has them.
std::optional<WorldProperties> MessageRelay::WorldForClients(Tick now, Tick committed) const {
  for (auto version = instance_.rbegin(); version != instance_.rend(); ++version) {
    if (version->own ? version->made > committed : version->seen > now) continue;
    return WorldProperties{version->epoch, version->made, version->bytes};
  }
  return std::nullopt;
}

std::span<const std::uint8_t> MessageRelay::InstanceProperties(Tick now) const {
  for (auto version = instance_.rbegin(); version != instance_.rend(); ++version) {
    if (version->seen <= now) return version->bytes;
  }
  return {};
}

}  // namespace tessera::region
