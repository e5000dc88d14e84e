#include "region_worker/pair_broadcast.h"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "core/physics/world.h"
#include "core/world/ids.h"
#include "core/world/math.h"
#include "core/world/proto_math.h"
#include "tessera/v1/game.pb.h"

namespace tessera::worker {
namespace {

struct PlacedPair {
  physics::PairEvent event;
  region::Region::Audience a, b;
  std::optional<Vec3d> place;  // nothing: its body has just gone
  std::optional<physics::Contact> contact;
  bool for_all = false;  // not for the one alone who moves one of the two
};

// The player to whom a client belongs.
struct Watcher {
  BodyId own;
  TeamId team = 0;
};

bool MaySeeBoth(const PlacedPair& pair, const Watcher& watcher) {
  return (pair.event.body_a == watcher.own || MaySee(pair.a.visible_to, pair.a.team, watcher.team)) &&
         (pair.event.body_b == watcher.own || MaySee(pair.b.visible_to, pair.b.team, watcher.team));
}

std::optional<Vec3d> PlaceOf(const region::Region& region, BodyId id) {
  const std::span<const region::OwnedBody> owned = region.owned();
  const auto at = std::lower_bound(owned.begin(), owned.end(), id,
                                   [](const region::OwnedBody& body, BodyId wanted) { return body.def->id < wanted; });
  if (at == owned.end() || at->def->id != id) return std::nullopt;
  return at->state.position;
}

// Whether all clients may be sent it: a pair of a trigger, or of a player's body. Players have the highest ids.
bool IsForAll(const physics::PairEvent& event) { return event.trigger || IsPlayerBody(event.body_b); }

bool IsOf(const physics::PairEvent& event, BodyId body) {
  return body != BodyId() && (event.body_a == body || event.body_b == body);
}

// The pairs that concern clients, those of `moved`, ascending, among them. `whole`: all that touch, not those that have
// just begun.
std::vector<PlacedPair> Placed(const region::Region& region, std::span<const physics::PairEvent> events, bool whole,
                               std::span<const BodyId> moved) {
  std::vector<PlacedPair> placed;
  placed.reserve(events.size());
  for (const physics::PairEvent& event : events) {
    const bool for_all = IsForAll(event);
    if (!for_all && !std::ranges::binary_search(moved, event.body_a) &&
        !std::ranges::binary_search(moved, event.body_b)) {
      continue;
    }
    const std::optional<Vec3d> place = PlaceOf(region, event.body_a);
    std::optional<physics::Contact> contact;
    if (!whole && event.begin) contact = region.world().ContactBetween(event.body_a, event.body_b);
    placed.push_back({event, region.AudienceOf(event.body_a), region.AudienceOf(event.body_b),
                      place ? place : PlaceOf(region, event.body_b), contact, for_all});
  }
  return placed;
}

void PutPair(const PlacedPair& placed, v1::PairEvents& pairs) {
  const physics::PairEvent& event = placed.event;
  v1::PairEvent& pair = *pairs.add_events();
  pair.set_body_a(event.body_a.value());
  pair.set_body_b(event.body_b.value());
  pair.set_trigger(event.trigger);
  pair.set_begin(event.begin);
  if (!placed.contact) return;
  v1::PairContact& contact = *pair.mutable_contact();
  *contact.mutable_point() = ToProto(placed.contact->point);
  *contact.mutable_normal() = ToProto(Vec3d(placed.contact->normal));
  contact.set_impulse(Length(Vec3d(placed.contact->impulse_on_b)));
}

// The client's player moves `now` instead of `before`: what touches the first begins, and what touches the other ends.
void PutChange(const region::Region& region, BodyId before, BodyId now, const Watcher& watcher, v1::PairEvents& pairs) {
  for (const physics::PairEvent& touching : region.touching()) {
    if (IsForAll(touching) || IsOf(touching, before) == IsOf(touching, now)) continue;
    PlacedPair change{touching, region.AudienceOf(touching.body_a), region.AudienceOf(touching.body_b), {}, {}};
    change.event.begin = IsOf(touching, now);
    if (MaySeeBoth(change, watcher)) PutPair(change, pairs);
  }
}

}  // namespace

std::vector<BodyId> PairBroadcast::OthersMoved(const region::Region& region, const GamePort& port) const {
  std::vector<BodyId> moved;
  for (const auto& [peer, body] : informed_) {
    if (body != BodyId()) moved.push_back(body);
  }
  for (const auto& [peer, client] : port.clients()) {
    const BodyId body = region.MovedBy(client.player);
    if (body != PlayerBodyId(client.player)) moved.push_back(body);
  }
  std::ranges::sort(moved);
  return moved;
}

void PairBroadcast::AfterTick(const region::Region& region, std::span<const physics::PairEvent> events,
                              const PlayerPlaces* places, GamePort& port) {
  const std::vector<BodyId> others = OthersMoved(region, port);
  std::optional<std::vector<PlacedPair>> touching, changed;  // made when a client needs them
  for (const auto& [peer, client] : port.clients()) {
    const auto [known, whole] = informed_.try_emplace(peer);
    std::optional<std::vector<PlacedPair>>& pairs = whole ? touching : changed;
    if (!pairs) pairs = Placed(region, whole ? region.touching() : events, whole, others);
    const BodyId own = PlayerBodyId(client.player);
    const BodyId moved = region.MovedBy(client.player);
    const BodyId other = moved == own ? BodyId() : moved, before = std::exchange(known->second, other);
    const bool changes = !whole && other != before;
    const TeamId team = region.Owns(own)    ? region.AudienceOf(own).team
                        : places != nullptr ? places->TeamAt(client.player, region.tick())
                                            : 0;
    const std::optional<Vec3d> centre = reach_m_ > 0 ? PlaceOf(region, own) : std::nullopt;
    v1::RegionControl message;
    v1::PairEvents& sent = *message.mutable_pair_events();
    for (const PlacedPair& pair : *pairs) {
      // With a change, what touches now begins and ends below.
      const bool ended = changes && !pair.event.begin && IsOf(pair.event, before);
      if (!pair.for_all && !ended && (changes || !IsOf(pair.event, other))) continue;
      const bool concerns = !centre || !pair.place || pair.event.body_a == moved || pair.event.body_b == moved ||
                            Length(*pair.place - *centre) <= reach_m_;
      if (concerns && MaySeeBoth(pair, {own, team})) PutPair(pair, sent);
    }
    if (changes) PutChange(region, before, other, {own, team}, sent);
    if (sent.events().empty() && !whole) continue;
    sent.set_tick(region.tick().value());
    sent.set_whole(whole);
    port.Send(peer, message);
  }
  if (informed_.size() == port.clients().size()) return;
  absl::erase_if(informed_, [&](const auto& entry) { return !port.clients().contains(entry.first); });
}

}  // namespace tessera::worker
