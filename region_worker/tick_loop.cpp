#include "region_worker/tick_loop.h"

#include <algorithm>
#include <array>
#include <ctime>

#include "core/region/standby.h"
#include "spdlog/spdlog.h"
#include "telemetry/logging.h"

namespace tessera::worker {
namespace {

constexpr Duration kLogDistance = std::chrono::seconds(1);
constexpr int kLongTick = 2;  // times as long as it should be: told in the log

double Seconds(Duration duration) { return std::chrono::duration<double>(duration).count(); }

std::int64_t Ms(Duration duration) { return std::chrono::duration_cast<std::chrono::milliseconds>(duration).count(); }

Duration CpuTimeOfThread() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return std::chrono::seconds(now.tv_sec) + std::chrono::nanoseconds(now.tv_nsec);
}

}  // namespace

TickLoop::TickLoop(region::Config config, std::uint32_t snapshot_rate_hz, const replication::Settings& replication,
                   RegionLinks& links, GamePort& game, WorkerMetrics& metrics)
    : region_(config),
      links_(links),
      game_(game),
      metrics_(metrics),
      heir_log_(links, region_, lease_, metrics),
      tick_rate_hz_(config.scene->tick_rate_hz),
      scene_has_players_(config.scene->player.has_value()),
      pacer_(tick_rate_hz_),
      broadcast_(config.self, *config.scene, snapshot_rate_hz, replication, metrics) {
  if (scene_has_players_ && replication.interest_radius_m > 0) places_.emplace(tick_rate_hz_);
  links_.Send(region_.Start());
  KeepCensus();
  ShowBodies();
}

void TickLoop::SetPlayers(std::span<const OrderedPlayer> players, bool joins) {
  for (const OrderedPlayer& player : players) {
    region_.ParkPlayer(player.number, player.parked);
    if (player.left) {
      if (left_.insert(player.number).second) game_.Expel(player.number);
    } else if (scene_has_players_ && player.spawn_region == region_.id() &&
               asked_to_spawn_.insert(player.number).second) {
      if (joins) {
        region_.MarkSpawned(player.number);
        continue;
      }
      spdlog::info("spawn player={}", player.number.value());
      region_.SpawnPlayer(player.number);
      spawning_.push_back(player.number);
    }
  }
  named_.clear();
  for (const OrderedPlayer& player : players) {
    named_.insert(player.number);
    newest_named_ = std::max(newest_named_, player.number);
  }
  const auto forgotten = [this](PlayerNumber player) { return !named_.contains(player); };
  std::erase_if(left_, forgotten);
  std::erase_if(asked_to_spawn_, forgotten);
}

// Players are numbered as they come, and an order that names one no more has forgotten that it left.
bool TickLoop::HasLeft(PlayerNumber player) const {
  return left_.contains(player) || (player <= newest_named_ && !named_.contains(player));
}

void TickLoop::OnFrame(RegionId from, std::span<const std::uint8_t> bytes, TimePoint now) {
  if (const absl::Status status = region_.Receive(from, bytes); !status.ok()) NoteDropped("frame", from, status, now);
}

void TickLoop::OnPlaces(RegionId from, std::span<const std::uint8_t> bytes, TimePoint now) {
  if (!places_) return;
  if (const absl::Status status = places_->Hear(bytes, region_.tick()); !status.ok()) {
    NoteDropped("places", from, status, now);
  }
}

void TickLoop::NoteDropped(std::string_view what, RegionId from, const absl::Status& status, TimePoint now) {
  metrics_.CountDropped(ReasonOf(status));
  ++drops_unlogged_;
  if (now < may_log_drop_at_) return;
  may_log_drop_at_ = now + kLogDistance;
  spdlog::warn("{} dropped from={} reason={} since_last_line={}", what, from.value(),
               telemetry::LogValue(std::string(status.message())), std::exchange(drops_unlogged_, 0));
}

void TickLoop::OnInput(const ClientInput& input, TimePoint now) {
  Client* client = game_.Find(input.peer);
  if (client == nullptr) return;
  const replication::InputCommand& command = input.command;
  const absl::Status status = region_.QueueInput({.player = client->player,
                                                  .number = command.number,
                                                  .body = command.body,
                                                  .force_n = command.force_n,
                                                  .torque_nm = command.torque_nm});
  const bool misplaced = status.code() == absl::StatusCode::kNotFound && command.body == PlayerBodyId(client->player);
  if (misplaced) {
    // The body is being handed over, to or from here: not the player's fault, and it may be here when the input comes
    // again.
    if (command.number <= client->newest_misplaced) return;
    client->newest_misplaced = command.number;
    metrics_.inputs_refused.Increment();
    return;
  }
  client->newest_input = std::max(client->newest_input, command.number);
  if (status.ok()) {
    metrics_.inputs_applied.Increment();
  } else if (status.code() == absl::StatusCode::kOutOfRange) {
    metrics_.inputs_late.Increment();
  } else {
    metrics_.inputs_refused.Increment();
    game_.TellInputRefused(input.peer, command, std::string(status.message()), now);
  }
}

void TickLoop::Run(TimePoint now) {
  running_ = true;
  stepped_at_ = now;
  pacer_.Start(now);
  game_.TellStarted(region_.tick());
}

bool TickLoop::Advance() {
  const TimePoint now = Clock::now();
  heir_log_.Follow(now);
  if (!MayStep(now)) {
    CareForNeighbors(now);
    return false;
  }
  since_step_.waiting = waiting_since_ ? now - *waiting_since_ : Duration(0);
  metrics_.frame_wait.Observe(Seconds(since_step_.waiting));
  pacer_.Began(now);
  waiting_since_.reset();
  StepOnce(now);
  return true;
}

bool TickLoop::MayStep(TimePoint now) {
  if (!running_ || left_out_ || region_.halted()) return false;
  const bool held = lease_.Held(now);
  if (paused_ == held) {
    paused_ = !held;
    metrics_.paused.Set(paused_ ? 1 : 0);
    spdlog::warn("{} tick={}", paused_ ? "paused: no lease" : "resumed: the lease is back", region_.tick().value());
    if (!paused_) pacer_.Start(now);
  }
  if (paused_ || now < pacer_.due()) return false;
  if (region_.CanStep()) return true;
  if (!waiting_since_) waiting_since_ = now;
  return false;
}

// Whoever waits is well, and says so, and its last frame with it; only who says nothing at all is given up.
void TickLoop::CareForNeighbors(TimePoint now) {
  if (!running_ || paused_ || now < care_at_ || now - stepped_at_ < kCareDistance) return;
  const bool stood_still = now > care_at_ + kCareDistance;  // then what is silent was only not listened to
  care_at_ = now + kCareDistance;
  for (const RegionId neighbor : region_.neighbors()) links_.SendNow(neighbor, Bare(LinkMessageKind::kAlive));
  links_.SendAgain();
  if (!stepped_ || left_out_ || region_.halted()) return;  // one that joins waits for its tick
  CloseSilent(now, stood_still);
}

void TickLoop::CloseSilent(TimePoint now, bool stood_still) {
  const std::vector<RegionId> missing = region_.WaitingFor();
  std::erase_if(missing_since_, [&](const auto& entry) {
    return stood_still || std::find(missing.begin(), missing.end(), entry.first) == missing.end();
  });
  for (const RegionId neighbor : missing) {
    const TimePoint since = missing_since_.try_emplace(neighbor, now).first->second;
    const TimePoint heard = std::max(since, links_.HeardFrom(neighbor).value_or(TimePoint()));
    if (now - heard < kSilence && now - since < kStuck) continue;
    spdlog::warn("border closed region={} tick={} silent_ms={}", neighbor.value(), region_.tick().value(),
                 Ms(now - heard));
    metrics_.borders_closed.Increment();
    region_.Close(neighbor);
    missing_since_.erase(neighbor);
  }
}

void TickLoop::StepOnce(TimePoint begin) {
  RemoveLeft();
  property_orders_.Apply(region_);
  region::StepResult result = TimedStep();
  if (std::exchange(resumed_, false)) {
    const auto gap = Ms(begin - stepped_at_);
    counts_.last_gap_ms = static_cast<std::uint64_t>(gap);
    metrics_.failover_gap.Set(static_cast<double>(gap) * 1e-3);
    spdlog::info("moving again tick={} gap_ms={}", region_.tick().value(), gap);
  }
  NoteTickLength(begin);
  stepped_ = true;
  stepped_at_ = begin;
  missing_since_.clear();
  Publish(std::move(result), begin);

  const TimePoint end = Clock::now();
  since_step_.stepping = end - begin;
  rate_.Observe(end, region_.tick());
  const Duration whole = end - begin + std::exchange(receive_time_, Duration(0));
  step_times_.Add(whole);
  metrics_.step.Observe(Seconds(whole));
  if (pacer_.Finished(end)) {
    ++counts_.late_ticks;
    metrics_.late_ticks.Increment();
  }
}

bool TickLoop::IsInMap() const {
  const auto regions = region_.map().regions();
  return std::any_of(regions.begin(), regions.end(), [&](const MapRegion& r) { return r.id == region_.id(); });
}

void TickLoop::NoteTickLength(TimePoint now) {
  const Duration worked = CpuTimeOfThread();
  since_step_.worked = worked - std::exchange(worked_until_, worked);
  const TickLength tick = std::exchange(since_step_, {});
  if (!stepped_) return;
  longest_tick_.Add(now, {.whole = now - stepped_at_, .worked = tick.worked});
  metrics_.longest_tick.Set(Seconds(longest_tick_.longest().whole));
  metrics_.longest_tick_cpu.Set(Seconds(longest_tick_.longest().worked));
  if (now - stepped_at_ <= kLongTick * pacer_.tick_length() || now < may_log_long_at_) return;
  may_log_long_at_ = now + kLogDistance;
  spdlog::info("long tick={} ms={} cpu_ms={} stepping_ms={} waiting_ms={}", region_.tick().value(),
               Ms(now - stepped_at_), Ms(tick.worked), Ms(tick.stepping), Ms(tick.waiting));
}

void TickLoop::Publish(region::StepResult result, TimePoint now) {
  left_out_ = !IsInMap();
  links_.Send(std::move(result.frames));
  heir_log_.Send(result.log, result.tick, now);
  TellPlaces();
  broadcast_.AfterTick(region_, result.departures, places_ ? &*places_ : nullptr, game_);
  game_.TellPairs(region_, result.events);
  Count(result);
  if (region::DueAt(region_.tick(), tick_rate_hz_)) KeepCensus();
}

void TickLoop::TellPlaces() {
  if (!places_) return;
  places_->Follow(region_.tick(), region_.owned());
  const std::vector<std::uint8_t> news = places_->Tell(region_.tick());
  if (news.empty()) return;
  for (const RegionId neighbor : region_.neighbors()) links_.SendNow(neighbor, news);
}

absl::Status TickLoop::Resume(const region::Resolution& resolution, std::span<const region::Standby* const> wards) {
  absl::StatusOr<region::StepResult> result = region_.Resume(resolution, wards);
  if (!result.ok()) return result.status();
  // The last tick that any live region had stepped; resume_tick leaves one out.
  const std::uint64_t newest = resolution.resume_tick.value() - 2;
  std::uint64_t age_ticks = 0;
  for (const region::Standby* ward : wards) {
    age_ticks = std::max(age_ticks, newest - std::min(newest, ward->tick().value()));
  }
  NoteTakeover(age_ticks);
  const TimePoint now = Clock::now();
  metrics_.failovers.Increment();
  Publish(*std::move(result), now);
  pacer_.Start(now);
  resumed_ = true;
  waiting_since_.reset();
  return absl::OkStatus();
}

region::StepResult TickLoop::TimedStep() {
  std::array<TimePoint, static_cast<std::size_t>(region::Phase::kDone) + 1> entered{};
  region::StepResult result =
      region_.Step([&entered](region::Phase phase) { entered[static_cast<std::size_t>(phase)] = Clock::now(); });
  const auto length_of = [&](region::Phase phase) {
    const auto index = static_cast<std::size_t>(phase);
    return Seconds(entered[index + 1] - entered[index]);
  };
  metrics_.physics.Observe(length_of(region::Phase::kPhysics));
  metrics_.prediction.Observe(length_of(region::Phase::kPrediction));
  return result;
}

void TickLoop::Count(const region::StepResult& result) {
  const auto removed = std::count_if(result.departures.begin(), result.departures.end(), [&](const auto& departure) {
    return departure.reason == region::DepartureReason::kRemoved &&
           std::find(result.nonfinite.begin(), result.nonfinite.end(), departure.body) == result.nonfinite.end();
  });
  counts_.removed_bodies += static_cast<std::uint64_t>(removed);
  counts_.nonfinite_bodies += result.nonfinite.size();
  counts_.handovers_in += result.handed_in;
  counts_.handovers_out += result.handed_out;
  CountSpawned();
  for (const BodyId body : result.nonfinite) {
    spdlog::error("body not finite, taken out body={}", body.value());
    taken_out_.push_back(body);
    if (taken_out_.size() > kTakenOutKept) taken_out_.pop_front();
  }

  metrics_.ticks.Increment();
  if (result.handed_in > 0) metrics_.handovers_in.Increment(result.handed_in);
  if (result.handed_out > 0) metrics_.handovers_out.Increment(result.handed_out);
  if (!result.nonfinite.empty()) metrics_.nonfinite_bodies.Increment(static_cast<double>(result.nonfinite.size()));
  ShowBodies();
}

void TickLoop::CountSpawned() {
  counts_.spawned_bodies +=
      std::erase_if(spawning_, [&](PlayerNumber player) { return region_.Owns(PlayerBodyId(player)); });
}

void TickLoop::ShowBodies() {
  metrics_.tick.Set(static_cast<double>(region_.tick().value()));
  metrics_.owned.Set(static_cast<double>(region_.owned_count()));
  metrics_.ghosts.Set(static_cast<double>(region_.ghost_count()));
  metrics_.asleep.Set(static_cast<double>(region_.asleep_count()));
}

// A body may be on its way from another region when its player leaves, so this is asked again and again.
void TickLoop::RemoveLeft() {
  const std::span<const region::OwnedBody> owned = region_.owned();
  // Players' bodies have the highest ids.
  for (auto body = owned.rbegin(); body != owned.rend() && IsPlayerBody(body->def->id); ++body) {
    if (HasLeft(PlayerOf(body->def->id))) region_.RemovePlayer(PlayerOf(body->def->id));
  }
}

void TickLoop::KeepCensus() {
  censuses_.push_back(region::TakeCensus(region_.tick(), region_.owned()));
  if (censuses_.size() > kCensusesKept) censuses_.pop_front();
}

std::optional<TimePoint> TickLoop::wake_at(TimePoint now) const {
  if (!running_ || paused_ || left_out_ || region_.halted() || now >= pacer_.due()) return std::nullopt;
  return pacer_.due();
}

}  // namespace tessera::worker
