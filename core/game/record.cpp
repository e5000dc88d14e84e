#include "core/game/record.h"

#include <algorithm>
#include <tuple>

#include "absl/strings/str_cat.h"
#include "core/game/settings.h"
#include "core/game/value.h"
#include "core/world/state_check.h"

namespace tessera::game {
namespace {

auto Order(const GameTimer& timer) { return std::tuple(timer.due, timer.number); }

}  // namespace

void Write(ByteWriter& out, const GameRecord& record) {
  out.Varint(record.last_timer);
  out.Varint(record.timers.size());
  for (const GameTimer& timer : record.timers) {
    out.Varint(timer.due.value());
    out.Varint(timer.number);
    out.Block(std::string_view(timer.name));
    out.Block(timer.values);
  }
  out.Varint(record.expires.value());
  out.U8(record.pushes() ? 1 : 0);
  if (!record.pushes()) return;
  out.V(record.push_ns);
  out.V(record.push_nms);
}

GameRecord ReadRecord(ByteReader& in) {
  GameRecord record;
  record.last_timer = in.Varint32();
  const std::uint64_t count = in.Varint();
  if (count > kMaxTimers) in.Fail("more than 16 timers");
  for (std::uint64_t i = 0; in.ok() && i < count; ++i) {
    GameTimer& timer = record.timers.emplace_back();
    timer.due = Tick(in.Varint());
    timer.number = in.Varint32();
    const auto name = in.Block(kMaxTimerNameBytes);
    timer.name.assign(name.begin(), name.end());
    const auto values = in.Block(kMaxFieldBytes);
    timer.values.assign(values.begin(), values.end());
  }
  record.expires = Tick(in.Varint());
  const std::uint8_t pushes = in.U8();
  if (pushes > 1) in.Fail("unknown flags");
  if (pushes != 1) return record;
  record.push_ns = in.V3f();
  record.push_nms = in.V3f();
  return record;
}

absl::Status CheckRecord(const GameRecord& record) {
  if (record.timers.size() > kMaxTimers) return absl::InvalidArgumentError("timers: more than 16");
  if (!std::ranges::is_sorted(record.timers, std::less_equal<>(), Order)) {
    return absl::InvalidArgumentError("timers: out of order");
  }
  for (const GameTimer& timer : record.timers) {
    if (timer.number == 0 || timer.number > record.last_timer) {
      return absl::InvalidArgumentError(absl::StrCat("timers: ", timer.number, " is no number of a timer"));
    }
    if (timer.name.size() > kMaxTimerNameBytes) return absl::InvalidArgumentError("timers: a name is too long");
    if (const auto fields = DecodeFields(timer.values); !fields.ok()) {
      return absl::InvalidArgumentError(absl::StrCat("timers: ", fields.status().message()));
    }
  }
  if (!IsSaneImpulse(record.push_ns) || !IsSaneAngularImpulse(record.push_nms)) {
    return absl::InvalidArgumentError("push: is not finite, or too strong");
  }
  return absl::OkStatus();
}

}  // namespace tessera::game
