#include "games/arena/bot/arena_player.h"

#include <cmath>
#include <cstdio>
#include <optional>

namespace tessera::arena {
namespace {

constexpr double kThrowSpeed_m_s = 16, kGravity_m_s2 = 9.81;
constexpr double kGoal_x_m = 35, kGoalHeight_m = 1.2, kGoalHalfWidth_m = 2;
constexpr double kHand_m = 0.6;  // where balls leave, above the body's middle
constexpr double kArrived_m = 1;
constexpr int kPatience = 900;         // frames after which it is near enough
constexpr int kAim = 20, kWatch = 40;  // frames of standing until it throws, and until it goes on
constexpr double kHighThrow_rad = 0.7;
constexpr int kGrabs = 40;  // frames of walking from one try to the next
constexpr double kGrab_rad = -0.2;

// The lower elevation of a throw that hits a point so far away and so much higher; none if it is out of reach.
// Ballistics without drag: tan a = (v^2 - sqrt(v^4 - g (g d^2 + 2 h v^2))) / (g d).
std::optional<double> Elevation(double distance_m, double height_m) {
  const double v2 = kThrowSpeed_m_s * kThrowSpeed_m_s;
  const double root = v2 * v2 - kGravity_m_s2 * (kGravity_m_s2 * distance_m * distance_m + 2 * height_m * v2);
  if (root < 0) return std::nullopt;
  return std::atan2(v2 - std::sqrt(root), kGravity_m_s2 * distance_m);
}

std::string Command(const char* what, double yaw_rad, double pitch_rad) {
  char command[64];
  std::snprintf(command, sizeof command, "%s %.4f %.4f", what, yaw_rad, pitch_rad);
  return command;
}

}  // namespace

void ArenaPlayer::Welcome(const std::string& team) {
  side_ = team == "red" ? 1 : -1;
  Wander();
}

void ArenaPlayer::Wander() {
  place_ = {side_ * Between(6, 20), 0, Between(-15, 15)};
  frames_ = standing_ = 0;
}

ArenaPlayer::Action ArenaPlayer::Frame(Vec3d position) {
  Action action;
  if (side_ == 0) return action;
  const Vec3d way = place_ - position;
  const bool there = std::hypot(way.x, way.z) < kArrived_m || ++frames_ > kPatience;
  if (there && ++standing_ == kAim) action.command = Throw(position);
  if (standing_ > kWatch) Wander();
  action.move = {0, there ? 0.0F : 1.0F};
  action.yaw_rad = static_cast<float>(std::atan2(-way.x, -way.z));
  if (!there && frames_ % kGrabs == 0) action.command = Command("grab", static_cast<double>(action.yaw_rad), kGrab_rad);
  action.buttons = 1;
  return action;
}

std::string ArenaPlayer::Throw(Vec3d from) {
  const Vec3d goal{side_ * kGoal_x_m, kGoalHeight_m, Between(-kGoalHalfWidth_m, kGoalHalfWidth_m)};
  const Vec3d way = goal - (from + Vec3d{0, kHand_m, 0});
  const double pitch_rad = Elevation(std::hypot(way.x, way.z), way.y).value_or(kHighThrow_rad);
  return Command("throw", std::atan2(-way.x, -way.z), pitch_rad);
}

double ArenaPlayer::Between(double low, double high) {  // SplitMix64 (Steele, Lea, Flood 2014)
  std::uint64_t z = random_ += 0x9e3779b97f4a7c15u;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return low + (high - low) * static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

}  // namespace tessera::arena
