#include "core/game/host_state.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <tuple>

#include "core/game/blast.h"
#include "core/game/settings.h"
#include "game_sdk/api/api.h"

namespace tessera::game {
namespace {

constexpr std::uint8_t kEventHasContact = 1, kEventIsBlast = 2;
constexpr std::size_t kMinEventBytes = 4, kMinFailedBytes = 4;

absl::Status BadHost(absl::string_view what) { return absl::InvalidArgumentError(what); }

bool IsEventOfBodies(std::uint32_t callback) {
  return (callback >= kOnBodyContact && callback <= kOnBodyLeft) || callback == kOnBodyBlast;
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

bool IsSaneEvent(const GameEvent& event) {
  const auto& contact = event.contact;
  if (contact && !(IsFinite(contact->point) && IsFinite(contact->normal) && std::isfinite(contact->impulse)))
    return false;
  if (event.blown && !(IsFinite(event.blown->at) && std::isfinite(event.blown->share))) return false;
  return event.blown.has_value() == (event.callback == kOnBodyBlast);
}

}  // namespace

void Write(ByteWriter& out, const HostState& state) {
  out.Varint(state.waiting.size());
  for (const GameEvent& event : state.waiting) {
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
  out.Varint(state.failed.size());
  for (const FailedCallback& failed : state.failed) {
    out.Varint(failed.callback);
    out.Varint(failed.kind);
    out.Varint(failed.failures);
    out.U8(failed.off ? 1 : 0);
  }
  out.Varint(state.next_ticked.value());
}

HostState ReadHostState(ByteReader& in) {
  HostState state;
  state.waiting.resize(in.Count(kMinEventBytes));
  if (state.waiting.size() > kMaxWaitingEvents) in.Fail("too many events");
  for (GameEvent& event : state.waiting) {
    if (!in.ok()) return state;
    event = ReadEvent(in);
  }
  state.failed.resize(in.Count(kMinFailedBytes));
  for (FailedCallback& failed : state.failed) {
    failed.callback = in.Varint32();
    failed.kind = static_cast<std::uint16_t>(in.Varint32());
    failed.failures = in.Varint32();
    const std::uint8_t off = in.U8();
    if (off > 1) in.Fail("a callback with unknown flags");
    failed.off = off != 0;
  }
  state.next_ticked = BodyId(in.Varint());
  return state;
}

absl::Status CheckHostState(const HostState& state, std::size_t kinds) {
  for (const GameEvent& event : state.waiting) {
    if (!IsEventOfBodies(event.callback)) return BadHost("host: an event of an unknown callback");
    if (!IsSaneEvent(event)) return BadHost("host: an event that is not sound");
  }
  const auto order = [](const FailedCallback& failed) { return std::tuple(failed.callback, failed.kind); };
  if (!std::ranges::is_sorted(state.failed, std::less_equal<>(), order)) {
    return BadHost("host: failed callbacks out of order");
  }
  for (const FailedCallback& failed : state.failed) {
    const Callback* const callback = FindCallback(failed.callback);
    if (callback == nullptr || failed.kind >= kinds) return BadHost("host: an unknown callback has failed");
    if ((callback->receiver == Receiver::kWorld) != (failed.kind == 0)) {
      return BadHost("host: a callback of another receiver has failed");
    }
  }
  return absl::OkStatus();
}

}  // namespace tessera::game
