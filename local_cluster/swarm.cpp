#include "local_cluster/swarm.h"

#include <time.h>

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"

namespace tessera::local {
namespace {

using client::Clock;
using client::TimePoint;

// While nobody is due, the thread looks this often whether somebody has come in.
constexpr std::chrono::milliseconds kIdle{5};

double ProcessCpuSeconds() {
  timespec spent{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &spent);
  return static_cast<double>(spent.tv_sec) + static_cast<double>(spent.tv_nsec) * 1e-9;
}

double SecondsPlayed(TimePoint begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

}  // namespace

Swarm::Swarm(SwarmOptions options)
    : options_(std::move(options)),
      schedule_(std::chrono::nanoseconds(static_cast<std::int64_t>(1e9 / options_.rate_hz)), options_.players) {
  players_.reserve(options_.players);
  joiner_ = std::thread([this] { JoinAll(); });
}

Swarm::~Swarm() {
  stop_ = true;
  joiner_.join();
}

void Swarm::JoinAll() {
  for (std::size_t i = 0; i < options_.players && !stop_; ++i) {
    auto bot =
        Bot::Join(options_.control, options_.instance_id, absl::StrCat(options_.name, "-", i + 1), options_.seed + i,
                  {}, /*predict=*/true, options_.tickets.empty() ? "" : options_.tickets.at(i));
    const std::lock_guard lock(mutex_);
    if (!bot.ok()) {
      join_error_ = bot.status();
      break;
    }
    joined_.push_back(*std::move(bot));
  }
  const std::lock_guard lock(mutex_);
  all_joined_ = true;
}

void Swarm::TakeJoined(TimePoint now) {
  const std::lock_guard lock(mutex_);
  for (std::unique_ptr<Bot>& bot : std::exchange(joined_, {})) {
    if (!begin_) {
      begin_ = now;
      begin_cpu_s_ = ProcessCpuSeconds();
    }
    schedule_.Add(players_.size(), now);
    players_.push_back({std::move(bot), now});
  }
}

void Swarm::Frame(std::size_t index, TimePoint now) {
  Player& player = players_[index];
  const bool going = player.bot->Frame(now);
  frames_.Add(Clock::now() - now);
  if (going) return;
  player.in = false;
  past_player_seconds_ += SecondsPlayed(player.since);
  schedule_.Remove(index);
  if (const absl::Status reason = player.bot->client().reason(); !reason.ok()) end_reason_ = reason;
}

bool Swarm::Run(std::chrono::nanoseconds span) {
  const TimePoint end = Clock::now() + span;
  while (true) {
    const TimePoint now = Clock::now();
    if (now >= end) return true;
    TakeJoined(now);
    if (const auto due = schedule_.Take(now)) {
      Frame(*due, now);
      continue;
    }
    const std::optional<TimePoint> next = schedule_.next();
    if (!next) {
      const std::lock_guard lock(mutex_);
      if (all_joined_ && joined_.empty()) return false;
    }
    std::this_thread::sleep_until(std::min({end, now + kIdle, next.value_or(end)}));
  }
}

SwarmReport Swarm::Report() const {
  SwarmReport report;
  report.wanted = options_.players;
  report.joined = players_.size();
  report.polls = schedule_.taken();
  report.late_polls = schedule_.late();
  report.player_seconds = past_player_seconds_;
  if (begin_) {
    report.seconds = SecondsPlayed(*begin_);
    report.cpu_seconds = ProcessCpuSeconds() - begin_cpu_s_;
  }
  double bodies = 0;
  for (const Player& player : players_) {
    const client::ClientStats stats = player.bot->client().Stats();
    report.bytes_in += stats.bytes_in;
    report.bytes_out += stats.bytes_out;
    report.corrections += stats.corrections;
    report.extrapolations += stats.extrapolations;
    if (!player.in) continue;
    ++report.in;
    report.player_seconds += SecondsPlayed(player.since);
    bodies += static_cast<double>(stats.bodies);
  }
  if (report.in != 0) report.mean_bodies = bodies / static_cast<double>(report.in);
  const client::DurationSummary frames = frames_.Summary();
  report.poll_p50_s = frames.p50_s;
  report.poll_p99_s = frames.p99_s;
  report.end_reason = end_reason_;
  const std::lock_guard lock(mutex_);
  report.join_error = join_error_;
  return report;
}

absl::Status Swarm::Leave() {
  stop_ = true;
  absl::Status first;
  TakeJoined(Clock::now());
  for (Player& player : players_) {
    if (!player.in) continue;
    player.in = false;
    first.Update(player.bot->client().Leave());
  }
  return first;
}

}  // namespace tessera::local
