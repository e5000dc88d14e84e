#include "control_plane/world_terms.h"

#include <algorithm>

#include "absl/strings/str_cat.h"

namespace tessera::control {
namespace {

v1::WorldTerms WantedTerms(const records::Instance& record, bool game_loaded) {
  v1::WorldTerms terms = TermsOf(record);
  terms.set_paused(record.clock().paused());
  terms.set_ticks_per_second(record.clock().ticks_per_second());
  if (record.games().has_next() && game_loaded) terms.set_game(record.games().next().number());
  return terms;
}

bool Same(const v1::WorldTerms& a, const v1::WorldTerms& b) {
  return a.paused() == b.paused() && a.ticks_per_second() == b.ticks_per_second() && a.game() == b.game();
}

records::Game InForceGame(const records::Instance& record) {
  records::Game game;
  game.set_name(record.game_name());
  game.set_hash(record.game_hash());
  game.set_number(record.map().terms().game());
  return game;
}

// `effective_tick` 0: to be found once it is announced.
void PlanSameCells(const records::Instance& record, const v1::WorldTerms& terms, std::uint64_t effective_tick,
                   records::Instance& next) {
  v1::PlannedMap& planned = *next.mutable_planned();
  *planned.mutable_map() = record.map();
  next.set_last_map_version(std::max(record.last_map_version(), record.map().version()) + 1);
  planned.mutable_map()->set_version(next.last_map_version());
  SetTerms(terms, *planned.mutable_map());
  planned.set_effective_tick(effective_tick);
  planned.set_committed(false);
}

}  // namespace

v1::WorldTerms TermsOf(const records::Instance& record) {
  v1::WorldTerms terms = record.map().terms();
  if (record.clock().resumed_version() >= record.map().version()) terms.set_paused(false);
  return terms;
}

bool IsPaused(const records::Instance& record) { return TermsOf(record).paused(); }

double PaceOf(const records::Instance& record) {
  const v1::WorldTerms terms = TermsOf(record);
  if (terms.paused()) return 0;
  return terms.ticks_per_second() > 0 ? terms.ticks_per_second() : record.tick_rate_hz();
}

std::optional<records::Instance> StepTerms(const records::Instance& record, bool game_loaded) {
  if (record.has_failover() || record.has_planned()) return std::nullopt;
  records::Instance next = record;
  if (IsPaused(record)) {
    if (record.clock().paused()) return std::nullopt;
    next.mutable_clock()->set_resumed_version(record.map().version());
    return next;
  }
  const v1::WorldTerms wanted = WantedTerms(record, game_loaded);
  if (Same(wanted, TermsOf(record))) return std::nullopt;
  PlanSameCells(record, wanted, 0, next);
  return next;
}

records::Instance PlanTicks(const records::Instance& record, std::uint64_t tick, std::uint32_t ticks) {
  records::Instance next = record;
  PlanSameCells(record, record.map().terms(), tick + ticks + 1, next);
  return next;
}

void ForgetStep(records::Instance& next) {
  if (IsPaused(next) && !next.planned().committed()) next.clear_planned();
}

void SetTerms(const v1::WorldTerms& terms, v1::PartitionMap& map) {
  map.clear_terms();
  if (!Same(terms, v1::WorldTerms())) *map.mutable_terms() = terms;
}

void AdoptTerms(const v1::PartitionMap& map, std::uint64_t tick, records::Instance& next) {
  const std::uint32_t number = map.terms().game();
  if (number == next.map().terms().game() || number != next.games().next().number()) return;
  records::Games& games = *next.mutable_games();
  *games.mutable_previous() = InForceGame(next);
  next.set_game_name(games.next().name());
  next.set_game_hash(games.next().hash());
  games.set_since_tick(tick);
  games.clear_next();
}

GameName GameAfter(const records::Instance& record, std::uint64_t tick) {
  records::Game game = InForceGame(record);
  const v1::PlannedMap& planned = record.planned();
  const bool changes = planned.committed() && planned.map().terms().game() != game.number();
  if (changes && tick + 1 >= planned.effective_tick()) {
    game = record.games().next();
  } else if (record.games().has_previous() && tick + 1 < record.games().since_tick()) {
    game = record.games().previous();
  }
  return {game.name(), game.hash(), game.number()};
}

std::string DescribeTerms(const records::Instance& before, const records::Instance& next, std::uint64_t tick) {
  const v1::WorldTerms old = TermsOf(before), now = TermsOf(next);
  if (now.paused() != old.paused()) {
    return now.paused() ? absl::StrCat("paused after tick ", tick - 1) : std::string("resumed");
  }
  if (now.game() != old.game()) {
    return absl::StrCat("game ", next.game_name(), " (", next.game_hash().substr(0, 12), ") from tick ", tick, " on");
  }
  if (now.ticks_per_second() != old.ticks_per_second()) {
    return absl::StrCat(PaceOf(next), " ticks a second from tick ", tick, " on");
  }
  return "";
}

}  // namespace tessera::control
