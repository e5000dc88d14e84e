#include "region_worker/pair_broadcast.h"

#include <algorithm>
#include <optional>
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
};

std::optional<Vec3d> PlaceOf(const region::Region& region, BodyId id) {
  const std::span<const region::OwnedBody> owned = region.owned();
  const auto at = std::lower_bound(owned.begin(), owned.end(), id,
                                   [](const region::OwnedBody& body, BodyId wanted) { return body.def->id < wanted; });
  if (at == owned.end() || at->def->id != id) return std::nullopt;
  return at->state.position;
}

// The pairs that concern clients: those of triggers and of players' bodies. `whole`: all that touch, not those that
// have just begun.
std::vector<PlacedPair> Placed(const region::Region& region, std::span<const physics::PairEvent> events, bool whole) {
  std::vector<PlacedPair> placed;
  placed.reserve(events.size());
  for (const physics::PairEvent& event : events) {
    // Players have the highest ids.
    if (!event.trigger && !IsPlayerBody(event.body_b)) continue;
    const std::optional<Vec3d> place = PlaceOf(region, event.body_a);
    std::optional<physics::Contact> contact;
    if (!whole && event.begin) contact = region.world().ContactBetween(event.body_a, event.body_b);
    placed.push_back({event, region.AudienceOf(event.body_a), region.AudienceOf(event.body_b),
                      place ? place : PlaceOf(region, event.body_b), contact});
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

}  // namespace

void PairBroadcast::AfterTick(const region::Region& region, std::span<const physics::PairEvent> events,
                              const PlayerPlaces* places, GamePort& port) {
  std::optional<std::vector<PlacedPair>> touching, changed;  // made when a client needs them
  for (const auto& [peer, client] : port.clients()) {
    const bool whole = informed_.insert(peer).second;
    std::optional<std::vector<PlacedPair>>& pairs = whole ? touching : changed;
    if (!pairs) pairs = Placed(region, whole ? region.touching() : events, whole);
    const BodyId own = PlayerBodyId(client.player);
    const BodyId moved = region.MovedBy(client.player);
    const TeamId team = region.Owns(own)    ? region.AudienceOf(own).team
                        : places != nullptr ? places->TeamAt(client.player, region.tick())
                                            : 0;
    const std::optional<Vec3d> centre = reach_m_ > 0 ? PlaceOf(region, own) : std::nullopt;
    v1::RegionControl message;
    v1::PairEvents& sent = *message.mutable_pair_events();
    for (const PlacedPair& pair : *pairs) {
      const bool concerns = !centre || !pair.place || pair.event.body_a == moved || pair.event.body_b == moved ||
                            Length(*pair.place - *centre) <= reach_m_;
      const bool shown = (pair.event.body_a == own || MaySee(pair.a.visible_to, pair.a.team, team)) &&
                         (pair.event.body_b == own || MaySee(pair.b.visible_to, pair.b.team, team));
      if (concerns && shown) PutPair(pair, sent);
    }
    if (sent.events().empty() && !whole) continue;
    sent.set_tick(region.tick().value());
    sent.set_whole(whole);
    port.Send(peer, message);
  }
  if (informed_.size() == port.clients().size()) return;
  absl::erase_if(informed_, [&](net::PeerHandle peer) { return !port.clients().contains(peer); });
}

}  // namespace tessera::worker
