#include "core/game/host_state.h"

#include <algorithm>
#include <functional>
#include <span>
#include <tuple>

#include "absl/strings/str_cat.h"
#include "core/game/settings.h"
#include "game_sdk/api/api.h"

namespace tessera::game {
namespace {

constexpr std::size_t kMinFailedBytes = 4;

absl::Status BadHost(absl::string_view what) { return absl::InvalidArgumentError(absl::StrCat("host: ", what)); }

}  // namespace

void Write(ByteWriter& out, const HostState& state) {
  Write(out, std::span<const GameEvent>(state.waiting));
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
  state.waiting = ReadEvents(in, kMaxWaitingEvents);
  if (!in.ok()) return state;
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
  if (const absl::Status events = CheckEvents(state.waiting); !events.ok()) return BadHost(events.message());
  const auto order = [](const FailedCallback& failed) { return std::tuple(failed.callback, failed.kind); };
  if (!std::ranges::is_sorted(state.failed, std::less_equal<>(), order)) {
    return BadHost("failed callbacks out of order");
  }
  for (const FailedCallback& failed : state.failed) {
    const Callback* const callback = FindCallback(failed.callback);
    if (callback == nullptr || failed.kind >= kinds) return BadHost("an unknown callback has failed");
    if ((callback->receiver == Receiver::kWorld) != (failed.kind == 0)) {
      return BadHost("a callback of another receiver has failed");
    }
  }
  return absl::OkStatus();
}

}  // namespace tessera::game
