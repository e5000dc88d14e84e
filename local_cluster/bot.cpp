#include "local_cluster/bot.h"

namespace tessera::local {
namespace {

// A waypoint counts as reached within this distance, m.
constexpr double kArrived_m = 4;
// Waypoints keep this far from the edge of the world, as a share of its size, where walls may stand.
constexpr double kEdge = 0.1;
constexpr const char* kArena = "arena";  // name of the scene in games/arena
constexpr std::chrono::microseconds kPlayInterval{16'667};
constexpr std::chrono::seconds kComeBackTimeout{2};
constexpr std::chrono::seconds kRenewTimeout{1}, kRenewInterval{1};

}  // namespace

absl::StatusOr<std::unique_ptr<Bot>> Bot::Join(const trust::ControlPoint& control, const std::string& instance_id,
                                               const std::string& name, std::uint64_t seed,
                                               const std::vector<std::uint8_t>& returning, bool predict,
                                               const std::string& ticket) {
  client::JoinOptions join{.control_address = control.address,
                           .instance_id = instance_id,
                           .player_name = ticket.empty() ? name : "",
                           .returning = returning,
                           .predict = predict,
                           .credentials = control.credentials,
                           .ticket = ticket};
  auto client = client::Client::Join(join);
  if (!client.ok()) return client.status();
  join.ticket.clear();  // good for one join
  return std::unique_ptr<Bot>(new Bot(*std::move(client), std::move(join), seed));
}

absl::StatusOr<std::unique_ptr<Bot>> Bot::Play(const std::string& file) {
  auto client = client::Client::Play(file);
  if (!client.ok()) return client.status();
  return std::unique_ptr<Bot>(new Bot(*std::move(client), client::JoinOptions{}, 1));
}

absl::Status Bot::ComeBack() {
  client::JoinOptions join = join_;
  join.returning = client_->return_token();
  join.deadline = kComeBackTimeout;
  auto client = client::Client::Join(join);
  if (!client.ok()) return client.status();
  client_ = *std::move(client);
  return absl::OkStatus();
}

bool Bot::Frame(client::TimePoint now) {
  using Kind = client::ClientEvent::Kind;
  events_ = client_->Poll(now);
  for (const client::ClientEvent& event : events_) {
    if (event.kind == Kind::kContactBegan || event.kind == Kind::kTriggerEntered) ++pairs_begun_;
    if (event.kind == Kind::kContactEnded || event.kind == Kind::kTriggerLeft) ++pairs_ended_;
    if (event.kind == Kind::kGrantNeeded) renew_at_ = now;
    if (event.kind == Kind::kRegionBack) renew_at_.reset();
  }
  if (client_->state() == client::ClientState::kEnded) return false;
  if (renew_at_ && now >= *renew_at_) Renew(now);
  const auto self = client_->World().find(client_->own_body());
  if (self != client_->World().end()) {
    if (region_ != RegionId() && self->second.region != region_) ++region_changes_;
    region_ = self->second.region;
    if (client_->scene().name == kArena) {
      PlayArena(self->second, now);
    } else {
      Steer(self->second);
    }
  }
  client_->Interpolated(now);
  return true;
}

// A grant that leads nowhere either is followed by another event after a while.
void Bot::Renew(client::TimePoint now) {
  client::JoinOptions join = join_;
  join.returning = client_->return_token();
  join.deadline = kRenewTimeout;
  const auto grant = client::Client::GetGrant(join);
  if (grant.ok() && client_->Renew(*grant).ok()) {
    renew_at_.reset();
  } else {
    renew_at_ = now + kRenewInterval;
  }
}

void Bot::Steer(const client::SeenBody& self) {
  const Vec3d to_waypoint = waypoint_.value_or(self.state.position) - self.state.position;
  const Vec3d flat{to_waypoint.x, 0, to_waypoint.z};
  if (Length(flat) < kArrived_m) {
    const Rect ground = client_->scene().ground();
    const auto pick = [this](double low, double high) {
      return low + (high - low) * (kEdge + (1 - 2 * kEdge) * Random());
    };
    waypoint_ = Vec3d(pick(ground.min_x, ground.max_x), self.state.position.y, pick(ground.min_z, ground.max_z));
    return;
  }
  const auto& player = client_->scene().player;
  const Vec3d way = Normalized(flat);
  // A character walks where it looks.
  const auto yaw = static_cast<float>(std::atan2(-way.x, -way.z));
  client_->Steer({.force_n = Vec3f(way * (player ? player->max_force_n : 0)),
                  .torque_nm = {},
                  .move = player && player->character ? Vec2f{0, 1} : Vec2f{},
                  .yaw_rad = player && player->character ? yaw : 0,
                  .pitch_rad = 0,
                  .buttons = 0});
}

void Bot::PlayArena(const client::SeenBody& self, client::TimePoint now) {
  for (const client::GameEvent& event : client_->TakeGameEvents()) {
    const auto* team = event.name == "welcome" && !event.values.empty()
                           ? std::get_if<std::string>(&event.values.front().second)
                           : nullptr;
    if (team != nullptr) arena_player_.Welcome(*team);
  }
  if (now < next_play_) return;  // frames may come faster than a player plays
  next_play_ = now + kPlayInterval;
  const arena::ArenaPlayer::Action act = arena_player_.Frame(self.state.position);
  client_->Steer({.force_n = {},
                  .torque_nm = {},
                  .move = act.move,
                  .yaw_rad = act.yaw_rad,
                  .pitch_rad = 0,
                  .buttons = act.buttons});
  if (!act.command.empty()) (void)client_->Send(act.command);  // one that cannot wait is not thrown
}

double Bot::Random() {  // xorshift64* (Vigna 2016)
  random_ ^= random_ >> 12;
  random_ ^= random_ << 25;
  random_ ^= random_ >> 27;
  return static_cast<double>((random_ * 0x2545f4914f6cdd1du) >> 11) * 0x1p-53;
}

}  // namespace tessera::local
