#include "region_worker/core/region_run.h"

#include <algorithm>
#include <iterator>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"

namespace tessera::worker {

RegionRun::RegionRun(const Identity& self, region::Config config, bool views_have_a_radius)
    : tick_rate_hz_(config.scene->tick_rate_hz),
      ticks_(config),
      copies_(ticks_.region().catalog()),
      maps_(ticks_.region()),
      clock_(tick_rate_hz_),
      failovers_(self),
      roster_(config.scene->player.has_value()) {
  const bool has_teams = !config.scene->team_property.empty();
  if (config.scene->player && (views_have_a_radius || has_teams)) places_.emplace(tick_rate_hz_);
}

void RegionRun::Begin(LinkTable& links, Actions& actions) {
  ticks_.SendFirstFrames(links, actions);
  statistics_.Begin(region());
}

void RegionRun::Run(TimePoint now, Actions& actions) {
  ticks_.Run(now);
  actions.emplace_back(PublishStart{region().tick()});
}

// --- Orders ----------------------------------------------------------------------------------------------------------

absl::Status RegionRun::Follow(const Order& order, TimePoint now, LinkTable& links, Actions& actions) {
  joins_ = order.joins_running;
  roster_.Set(order.players, order.joins_running, ticks_.region(), actions);
  properties_.Set(order.properties);
  backend_.Set(order.backend);
  // The dead come first: an order that declares a region dead names it a primary no more.
  if (absl::Status status = FollowFailover(order, now, links, actions); !status.ok()) return status;
  clock_.Resume(order.resumed);
  if (order.planned && !failovers_.under_way()) {
    maps_.Follow(*order.planned, clock_.paused(), ticks_.region(), actions);
  }
  if (failovers_.fenced()) return absl::OkStatus();
  copies_.Set(order.primaries, now, links, actions);
  standby_log_.SetStandby(order.standby, ticks_.region(), actions);
  return absl::OkStatus();
}

absl::Status RegionRun::FollowFailover(const Order& order, TimePoint now, LinkTable& links, Actions& actions) {
  if (order.failover) {
    const absl::StatusOr<bool> begun =
        failovers_.Begin(*order.failover, *order.map, ticks_.region(), copies_, links, actions);
    if (!begun.ok()) return begun.status();
    if (*begun) maps_.ForgetNext();
  }
  if (!order.resolution || !failovers_.TakesPart(*order.resolution)) return absl::OkStatus();
  return Resume(*order.resolution, now, links, actions);
}

absl::Status RegionRun::Resume(const region::Resolution& resolution, TimePoint now, LinkTable& links,
                               Actions& actions) {
  const std::vector<const region::StandbyCopy*> dead = copies_.Dead();
  absl::StatusOr<region::StepResult> result = ticks_.region().Resume(resolution, dead);
  if (!result.ok()) return result.status();
  // The last tick that any live region had stepped; resume_tick leaves one out.
  const std::uint64_t newest = resolution.resume_tick.value() - 2;
  failover_figures_.promotion_age_ticks = 0;
  for (const region::StandbyCopy* copy : dead) {
    const std::uint64_t age_ticks = newest - std::min(newest, copy->tick().value());
    failover_figures_.promotion_age_ticks = std::max(failover_figures_.promotion_age_ticks, age_ticks);
  }
  ++failover_figures_.failovers;
  links.SendFrames(std::exchange(result->frames, {}), actions);
  Publish(*std::move(result), now, links, actions);
  ticks_.Restart(now);
  resumed_ = true;
  failovers_.Resumed(resolution, actions);
  copies_.Forget(links, actions);
  return absl::OkStatus();
}

std::vector<RegionId> RegionRun::Partners(const Order& order) const {
  std::set<RegionId> all;
  const auto add = [&](std::span<const RegionId> regions) { all.insert(regions.begin(), regions.end()); };
  add(region().neighbors());
  if (maps_.next()) add(maps_.next()->Neighbors(region().id()));
  // A failover's map is in force only after its resolution; the links are there by then.
  if (failovers_.under_way() && order.map) add(order.map->Neighbors(region().id()));
  if (order.standby != RegionId()) all.insert(order.standby);
  add(order.primaries);
  return {all.begin(), all.end()};
}

std::vector<PropertyAnswer> RegionRun::PropertyAnswers() const {
  return properties_.Answers(region(), standby_log_.standby() != RegionId());
}

// --- Messages --------------------------------------------------------------------------------------------------------

void RegionRun::Receive(RegionId from, const LinkMessage& message, TimePoint now, LinkTable& links, Actions& actions) {
  absl::Status status;
  switch (message.kind) {
    case LinkMessageKind::kFrame:
      status = ticks_.region().Receive(from, message.bytes);
      if (!status.ok()) drops_.Dropped("frame", from, status, now, actions);
      return;
    case LinkMessageKind::kLog:
      return copies_.OnLog(from, message, now, links, actions);
    case LinkMessageKind::kLogTaken:
      return standby_log_.OnTaken(from, Tick(message.number), ticks_.region(), actions);
    case LinkMessageKind::kLogAgain:
      return standby_log_.OnAgain(from, ticks_.region(), actions);
    case LinkMessageKind::kLeaseAsk:
      return copies_.OnLeaseAsk(from, message.number, now, links, actions);
    case LinkMessageKind::kLeaseGiven:
      if (from == standby_log_.standby()) LeaseGranted(message.number, Lease::kTtl);
      return;
    case LinkMessageKind::kPlaces:
      if (!places_) return;
      status = places_->Receive(message.bytes, region().tick());
      if (!status.ok()) drops_.Dropped("places", from, status, now, actions);
      return;
    case LinkMessageKind::kAlive:
      return;  // that something came is all
  }
}

std::optional<std::uint64_t> RegionRun::AskForLease(TimePoint now, const LinkTable& links, Actions& actions) {
  const std::optional<std::uint64_t> number = standby_log_.AskForLease(now);
  if (number) links.Send(standby_log_.standby(), Numbered(LinkMessageKind::kLeaseAsk, *number), actions);
  return number;
}

// --- Steps -----------------------------------------------------------------------------------------------------------

bool RegionRun::Advance(TimePoint now, LinkTable& links, Actions& actions) {
  standby_log_.Follow(links, now, ticks_.region(), actions);
  copies_.Expire(now);
  WatchSilence(now, links);
  FollowClock(now, links, actions);
  if (MayStep(now, actions)) return true;
  if (!paused_) ticks_.Watch(now, MayGiveUp(), links, actions);
  return false;
}

// Before it runs, and while it is to join or is left out, the others need not answer it.
void RegionRun::WatchSilence(TimePoint now, const LinkTable& links) {
  if (!silent_links_.Due(now)) return;
  std::vector<RegionId> closed;
  if (ticks_.running() && !left_out_ && (!joins_ || ticks_.stepped())) {
    std::ranges::copy_if(region().neighbors(), std::back_inserter(closed),
                         [this](RegionId neighbor) { return !region().IsLinkUp(neighbor); });
  }
  silent_links_.Look(closed, links, now);
}

std::vector<RegionId> RegionRun::HeardLinks(const LinkTable& links) const {
  std::vector<RegionId> heard = links.Linked();
  std::erase_if(heard, [&](RegionId region) { return silent_links_.Is(region, links); });
  return heard;
}

// In a paused world a new standby gets its copy, although no step makes a log.
void RegionRun::FollowClock(TimePoint now, const LinkTable& links, Actions& actions) {
  const PartitionMap& map = region().map();
  if (clock_.paused() && !region().halted() && region().NeighborsGoOn()) clock_.Resume(map.version());
  const PartitionMap* const next = region().committed() && maps_.next() ? &*maps_.next() : nullptr;
  const bool was_paused = clock_.paused();
  if (clock_.Follow(map, next)) {
    const ClockState& state = clock_.state();
    ticks_.SetPace(state.ticks_per_second);
    if (was_paused && !state.paused) ticks_.Restart(now);
    LogInfo(actions, absl::StrCat(state.paused ? "world paused" : "world goes", " tick=", region().tick().value(),
                                  " ticks_per_second=", state.ticks_per_second));
    actions.emplace_back(PublishClock{state, region().tick()});
  }
  if (!clock_.paused() || !ticks_.running() || left_out_) return;
  standby_log_.Send(ticks_.region().WriteLogStanding(), region().tick(), now, links, actions);
}

bool RegionRun::MayStep(TimePoint now, Actions& actions) {
  if (!ticks_.running() || left_out_ || region().halted()) return false;
  const bool held = standby_log_.LeaseHeld(now);
  if (paused_ == held) {
    paused_ = !held;
    LogWarning(actions, absl::StrCat(paused_ ? "paused: no lease" : "resumed: the lease is back",
                                     " tick=", region().tick().value()));
    if (!paused_) ticks_.Restart(now);
  }
  return !paused_ && !clock_.paused() && ticks_.Due(now);
}

// One that joins waits for its tick, however long that takes. Once its map is in force the others go on to the next one
// without it, and drop its frames by that map: it goes on by itself as anybody would.
bool RegionRun::MayGiveUp() const { return !left_out_ && !clock_.paused() && (!joins_ || ticks_.stepped()); }

bool RegionRun::Moves(TimePoint now) const {
  return ticks_.running() && !left_out_ && !region().halted() && standby_log_.LeaseHeld(now);
}

void RegionRun::Step(TimePoint now, const region::PhaseObserver& observer, LinkTable& links, Actions& actions) {
  roster_.RemoveLeft(ticks_.region());
  properties_.Apply(ticks_.region());
  backend_.Apply(ticks_.region());
  const TimePoint before = ticks_.last_step();
  region::StepResult result = ticks_.Step(now, observer, links, actions);
  if (std::exchange(resumed_, false)) {
    const auto gap_ms = std::chrono::duration_cast<std::chrono::milliseconds>(now - before).count();
    failover_figures_.last_gap_ms = static_cast<std::uint64_t>(gap_ms);
    LogInfo(actions, absl::StrCat("moving again tick=", region().tick().value(), " gap_ms=", gap_ms));
  }
  Publish(std::move(result), now, links, actions);
}

void RegionRun::StepEnded(TimePoint end, Duration work) {
  const bool late = ticks_.StepEnded(end);
  statistics_.StepEnded(end, region().tick(), work, late);
}

void RegionRun::Publish(region::StepResult result, TimePoint now, const LinkTable& links, Actions& actions) {
  left_out_ = !region().map().HasRegion(region().id());
  standby_log_.Send(std::exchange(result.log, {}), result.tick, now, links, actions);
  SendPlaces(links, actions);
  roster_.CountSpawned(region());
  statistics_.Stepped(region(), result, tick_rate_hz_);
  for (const BodyId body : result.nonfinite) {
    LogError(actions, absl::StrCat("body not finite, taken out body=", body.value()));
  }
  if (game::GameHost* game = ticks_.region().game()) game_log_.Take(game->TakeLines(), now, actions);
  actions.emplace_back(PublishStep{std::move(result)});
}

void RegionRun::SendPlaces(const LinkTable& links, Actions& actions) {
  if (!places_) return;
  places_->Follow(region());
  region::Bytes bytes = places_->Write(region().tick());
  if (bytes.empty()) return;
  const auto news = std::make_shared<const region::Bytes>(std::move(bytes));
  for (const RegionId neighbor : region().neighbors()) links.Send(neighbor, news, actions);
}

std::optional<TimePoint> RegionRun::wake_at(TimePoint now) const {
  if (paused_ || left_out_ || clock_.paused()) return std::nullopt;
  return ticks_.wake_at(now);
}

}  // namespace tessera::worker
