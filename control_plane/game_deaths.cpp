#include "control_plane/game_deaths.h"

#include <algorithm>
#include <string>

#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "control_plane/control_settings.h"
#include "control_plane/instance_record.h"
#include "control_plane/life.h"
#include "control_plane/one_line.h"
#include "core/game/native_name.h"

namespace tessera::control {
namespace {

// Whether the worker was to run on this host. One that was silent while the kernel wrote its memory to the disk has
// been declared dead already.
bool WasPlaced(const records::Instance& record, const std::string& host_id, std::uint64_t incarnation) {
  const auto it_is = [&](const auto& entry) {
    return entry.host_id() == host_id && entry.incarnation() == incarnation;
  };
  const auto& placements = record.placements();
  const auto& dead = record.failover().dead();
  return std::any_of(placements.begin(), placements.end(), it_is) || std::any_of(dead.begin(), dead.end(), it_is);
}

// The one that the world runs: of its game, or of its movement.
v1::NativeGame LibraryOf(const records::Instance& record) {
  if (record.has_movement()) return record.movement();
  v1::NativeGame library;
  library.set_name(record.game_name());
  library.set_hash(record.game_hash());
  return library;
}

}  // namespace

std::optional<records::Instance> CountGameDeath(const records::Instance& record, std::uint64_t newest_tick,
                                                const records::Host& host, const v1::WorkerExited& exited) {
  const std::uint64_t incarnation = exited.identity().incarnation();
  const auto& counted = record.game_deaths().incarnations();
  if ((!record.game_native() && !record.has_movement()) || exited.died_in_game().empty() ||
      !WantsWorkers(record.state()) || std::find(counted.begin(), counted.end(), incarnation) != counted.end() ||
      !WasPlaced(record, host.id(), incarnation)) {
    return std::nullopt;
  }
  records::Instance next = record;
  records::GameDeaths& deaths = *next.mutable_game_deaths();
  const std::uint64_t stepped = newest_tick > deaths.tick() ? newest_tick - deaths.tick() : 0;
  if (stepped >= static_cast<std::uint64_t>(kGameDeathForgiven.count()) * record.tick_rate_hz()) {
    deaths.clear_incarnations();
  }
  deaths.add_incarnations(incarnation);
  deaths.set_tick(newest_tick);
  absl::string_view where = exited.died_in_game();
  absl::ConsumePrefix(&where, absl::StrCat(LibraryOf(record).name(), ": "));
  deaths.set_last(OneLine(absl::StrCat("region ", exited.identity().region(), " on ", host.name(), ": ", where),
                          kMaxReasonBytes / 2));
  return next;
}

std::optional<records::Instance> FailedByGame(const records::Instance& record, Now now) {
  const records::GameDeaths& deaths = record.game_deaths();
  if (record.state() != v1::INSTANCE_STATE_RUNNING || deaths.incarnations_size() < kMaxGameDeaths) return std::nullopt;
  const std::string why =
      absl::StrCat(record.has_movement() ? "the movement " : "its game ",
                   game::NativeGameText(LibraryOf(record).name(), LibraryOf(record).hash()), " crashed ",
                   deaths.incarnations_size(), " workers in a row, the last one that of ", deaths.last());
  records::Instance next = Failed(record, why, now);
  AddEvent(next, now, absl::StrCat("stopped: ", why));
  return next;
}

void FollowRestore(const records::Instance& before, std::uint64_t tick, records::Instance& next) {
  if (IsFinal(before.state())) {
    next.clear_game_deaths();
  } else if (next.has_game_deaths()) {
    next.mutable_game_deaths()->set_tick(tick);
  }
}

}  // namespace tessera::control
