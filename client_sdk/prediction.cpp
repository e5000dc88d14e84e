#include "client_sdk/prediction.h"

#include <algorithm>
#include <cstdio>

#include "client_sdk/blend.h"

namespace tessera::client {
namespace {

// A predicted state counts as such for so many ticks after the last word of the own body's region; a failover takes
// less, and a world in which nothing moves is heard of twice as often.
constexpr double kStaleAfter_ticks = 60;

}  // namespace

absl::Status Prediction::Begin(const std::shared_ptr<const Scene>& scene, PlayerNumber player,
                               std::shared_ptr<const LevelIndex> index) {
  predictor_.emplace(scene, player, std::move(index));
  if (movement_ == nullptr) return absl::OkStatus();
  return predictor_->SetMovement(std::exchange(movement_, nullptr));
}

absl::Status Prediction::SetMovement(const tessera_movement* movement) {
  movement_ = nullptr;
  const absl::Status status = movement == nullptr ? absl::OkStatus() : CheckMovement(*movement);
  const tessera_movement* const good = status.ok() ? movement : nullptr;
  if (!predictor_) {
    movement_ = good;
    return status;
  }
  const absl::Status fits = predictor_->SetMovement(good);
  return status.ok() ? fits : status;
}

void Prediction::Follow(BodyId own, const PlayerLimits& limits, const std::vector<game::JointOfBody>& joints) {
  if (!predictor_) return;
  predictor_->Follow(own, limits);
  predictor_->Connect(joints);
}

std::string Prediction::TakeMovement(const replication::MovementNews& news) {
  if (!predictor_) return "";
  predictor_->TakeMovement(news);
  return predictor_->TakeMissingMovement();
}

void Prediction::AddTile(std::uint32_t tile, std::shared_ptr<const Tile> content) {
  if (predictor_) predictor_->AddTile(tile, std::move(content));
}

void Prediction::DropTile(std::uint32_t tile) {
  if (predictor_) predictor_->DropTile(tile);
}

void Prediction::Add(const PlayerInput& input) {
  if (predictor_) predictor_->Add(input);
}

void Prediction::Heard(TimePoint now, std::optional<std::pair<Tick, std::uint32_t>> correct_to) {
  heard_at_ = now;
  if (correct_to) correct_to_ = correct_to;
}

void Prediction::Correct(const OwnBody& own, const WorldView& world, WorkBudget& budget,
                         std::vector<ClientEvent>& events) {
  if (!predictor_) return;
  const auto seen = world.bodies().find(own.id());
  if (seen == world.bodies().end()) {
    predictor_->Forget();
  } else {
    predictor_->Prepare(seen->second.state, budget);
  }
  if (correct_to_) predictor_->Correct(correct_to_->first, correct_to_->second, world.bodies());
  correct_to_.reset();
  for (const Correction& correction : predictor_->TakeCorrections()) {
    events.push_back({.kind = ClientEvent::Kind::kPredictionCorrected,
                      .body = own.id(),
                      .other = correction.met,
                      .region = seen == world.bodies().end() ? RegionId() : seen->second.region,
                      .input_number = correction.last_input,
                      .detail = Describe(correction)});
  }
}

void Prediction::ExpireThrown(TimePoint now, const WorldClock& clock, const WorldView& world,
                              std::vector<ClientEvent>& events) {
  if (!predictor_) return;
  predictor_->ExpireThrown(now, clock.paused);
  ReportThrown(world, events);
}

void Prediction::Forget() {
  correct_to_.reset();
  if (predictor_) predictor_->Forget();
}

BodyId Prediction::Throw(const SpawnAsk& ask, std::size_t prefab, SpawnClaim claim, std::uint32_t input,
                         TimePoint until) {
  return predictor_->Throw(ask, prefab, claim, input, until);
}

void Prediction::DropThrown(const WorldView& world, std::vector<ClientEvent>& events) {
  if (!predictor_) return;
  predictor_->DropThrown();
  ReportThrown(world, events);
}

void Prediction::ReportThrown(const WorldView& world, std::vector<ClientEvent>& events) {
  for (const ThrownNews& news : predictor_->TakeThrown()) {
    if (news.body == BodyId()) {
      events.push_back({.kind = ClientEvent::Kind::kSpawnLost, .body = news.thrown, .detail = news.why});
      continue;
    }
    char metres[32];
    std::snprintf(metres, sizeof(metres), "%.3f m off", news.off_m);
    events.push_back({.kind = ClientEvent::Kind::kSpawnTaken,
                      .body = news.body,
                      .other = news.thrown,
                      .region = world.OwnerOf(news.body).value_or(RegionId()),
                      .detail = metres,
                      .off_m = news.off_m});
  }
}

void Prediction::Show(TimePoint now, double phase, const WorldClock& clock, const WorldView& world,
                      std::vector<ShownBody>& shown) {
  if (!predictor_) return;
  // Whoever has heard nothing of the own body for long shows where it was to be, and knows no more than of others.
  const double silent_s = std::chrono::duration<double>(now - heard_at_).count();
  const bool stale = !clock.paused && silent_s * clock.ticks_per_second > kStaleAfter_ticks;
  auto at = shown.begin();
  std::vector<ShownBody> thrown;
  for (const PredictedBody& body : predictor_->At(now, phase)) {
    if (body.thrown) {
      thrown.push_back({.id = body.id,
                        .pose = body.pose,
                        .extrapolated = stale,
                        .predicted = !stale,
                        .velocity_m_s = body.velocity_m_s,
                        .spin_rad_s = body.spin_rad_s});
      continue;
    }
    while (at != shown.end() && at->id < body.id) ++at;
    if (at == shown.end() || at->id != body.id) continue;
    at->pose = Between(at->pose, body.pose, body.weight);
    at->predicted = body.weight > 0.5 && !stale;
    at->extrapolated = at->extrapolated || stale;
  }
  if (predictor_->thrown() > 0) ShowThrown(std::move(thrown), world, shown);
}

// Shows what the player has thrown, and not yet the server's bodies that take its place.
void Prediction::ShowThrown(std::vector<ShownBody> thrown, const WorldView& world,
                            std::vector<ShownBody>& shown) const {
  std::erase_if(shown, [&](const ShownBody& body) {
    if (!IsSpawned(body.id)) return false;
    const auto seen = world.bodies().find(body.id);
    return seen != world.bodies().end() && predictor_->Awaits(seen->second.tuning);
  });
  const auto of_server = std::ssize(shown);
  shown.insert(shown.end(), thrown.begin(), thrown.end());
  std::ranges::inplace_merge(shown, shown.begin() + of_server, {}, &ShownBody::id);
}

void Prediction::AddTo(ClientStats& stats) const {
  if (!predictor_) return;
  stats.corrections = predictor_->corrections();
  stats.last_correction_m = predictor_->last_correction_m();
  stats.predicting = predictor_->running();
}

}  // namespace tessera::client
