#include "core/game/game_event.h"

#include <algorithm>
#include <cmath>

#include "core/game/blast.h"
#include "game_sdk/api/api.h"

namespace tessera::game {
namespace {

constexpr std::uint8_t kEventHasContact = 1, kEventIsBlast = 2;
constexpr std::size_t kMinEventBytes = 4;

bool IsEventOfBodies(std::uint32_t callback) {
  return (callback >= kOnBodyContact && callback <= kOnBodyLeft) || callback == kOnBodyBlast;
}

bool IsSaneEvent(const GameEvent& event) {
  const auto& contact = event.contact;
  if (contact && !(IsFinite(contact->point) && IsFinite(contact->normal) && std::isfinite(contact->impulse))) {
    return false;
  }
  if (event.blown && !(IsFinite(event.blown->at) && std::isfinite(event.blown->share))) return false;
  return event.blown.has_value() == (event.callback == kOnBodyBlast);
}

void WriteEvent(ByteWriter& out, const GameEvent& event) {
  out.Varint(event.callback);
  out.Varint(event.self.value());
  out.Varint(event.other.value());
  out.U8(static_cast<std::uint8_t>((event.contact ? kEventHasContact : 0) | (event.blown ? kEventIsBlast : 0)));
  if (event.contact) {
    out.V(event.contact->point);
    out.V(event.contact->normal);
    out.F64(event.contact->impulse);
  }
  if (event.blown) {
    out.V(event.blown->at);
    out.F64(event.blown->share);
    out.Block(std::string_view(event.blown->name));
  }
}

GameEvent ReadEvent(ByteReader& in) {
  GameEvent event;
  event.callback = in.Varint32();
  event.self = BodyId(in.Varint());
  event.other = BodyId(in.Varint());
  const std::uint8_t flags = in.U8();
  if (flags > (kEventHasContact | kEventIsBlast)) in.Fail("an event with unknown flags");
  if ((flags & kEventHasContact) != 0) {
    GameEvent::Contact& contact = event.contact.emplace(GameEvent::Contact{});
    contact.point = in.V3d();
    contact.normal = in.V3d();
    contact.impulse = in.F64();
  }
  if ((flags & kEventIsBlast) != 0) {
    GameEvent::Blown& blown = event.blown.emplace(GameEvent::Blown{});
    blown.at = in.V3d();
    blown.share = in.F64();
    const auto name = in.Block(kMaxBlastNameBytes);
    blown.name.assign(name.begin(), name.end());
  }
  return event;
}

}  // namespace

void Write(ByteWriter& out, std::span<const GameEvent> events) {
  out.Varint(events.size());
  for (const GameEvent& event : events) WriteEvent(out, event);
}

std::vector<GameEvent> ReadEvents(ByteReader& in, std::size_t most) {
  std::vector<GameEvent> events(in.Count(kMinEventBytes));
  if (events.size() > most) in.Fail("too many events");
  for (GameEvent& event : events) {
    if (!in.ok()) return events;
    event = ReadEvent(in);
  }
  return events;
}

absl::Status CheckEvents(std::span<const GameEvent> events) {
  for (const GameEvent& event : events) {
    if (!IsEventOfBodies(event.callback)) return absl::InvalidArgumentError("an event of an unknown callback");
    if (!IsSaneEvent(event)) return absl::InvalidArgumentError("an event that is not sound");
  }
  return absl::OkStatus();
}

}  // namespace tessera::game
