#include "core/physics/pose_history.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tessera::physics {
namespace {

// A body that comes further in a tick than by four times its speed and this, m, was put there: a push in between makes
// most bodies no quicker than that.
constexpr double kJumpBeyond_m = 0.5;

}  // namespace

void PoseHistory::Note(Tick tick, double tick_s, const BodyStore& bodies, const NotedBodies& noted) {
  if (!frames_.empty() && frames_.back().tick + 1 != tick) frames_.clear();
  tick_s_ = tick_s;
  Frame frame;
  if (frames_.size() >= most_) {
    frame = std::move(frames_.front());  // with its memory
    frames_.pop_front();
  }
  frame.tick = tick;
  Fill(bodies, noted.own, frame.own);
  Fill(bodies, noted.ghosts, frame.ghosts);
  Fill(bodies, noted.fixed, frame.fixed);
  frames_.push_back(std::move(frame));
  const Tick oldest = frames_.front().tick;
  for (; !left_.empty() && left_.front().first < oldest; left_.pop_front()) {
    // One that came back and went again is known for longer.
    const auto gone = gone_.find(left_.front().second);
    if (gone != gone_.end() && gone->second.since < oldest) gone_.erase(gone);
  }
}

void PoseHistory::Fill(const BodyStore& bodies, std::span<const BodyId> ids, std::vector<Pose>& poses) {
  poses.clear();
  for (const BodyId id : ids) {
    const RigidBody* const body = bodies.Find(id);
    if (body == nullptr || body->isolated) continue;
    const Placement& placement = body->placement();
    poses.push_back({id, placement.position, placement.orientation, body->geometry().outer_radius_m,
                     static_cast<float>(Length(body->state().linear_velocity))});
  }
}

void PoseHistory::Left(const RigidBody& body) {
  if (frames_.empty() || !(body.dynamic() || body.kinematic())) return;
  gone_[body.id()] = {frames_.back().tick, body.shared_geometry(), body.layer().index, body.dynamic(), body.trigger()};
  left_.emplace_back(frames_.back().tick, body.id());
}

void PoseHistory::Forget() {
  frames_.clear();
  gone_.clear();
  left_.clear();
}

bool PoseHistory::Covers(double at) const {
  return !frames_.empty() && at >= static_cast<double>(frames_.front().tick.value()) &&
         at <= static_cast<double>(frames_.back().tick.value());
}

std::size_t PoseHistory::FrameAt(double at, double* part) const {
  const double last = static_cast<double>(frames_.size() - 1);
  const double place = std::clamp(at - static_cast<double>(frames_.front().tick.value()), 0.0, last);
  const double whole = std::floor(place);
  *part = place - whole;
  return static_cast<std::size_t>(whole);
}

const PoseHistory::Pose* PoseHistory::Find(const Frame& frame, BodyId id) {
  for (const std::vector<Pose>* poses : {&frame.own, &frame.ghosts, &frame.fixed}) {
    const auto found = std::ranges::lower_bound(*poses, id, {}, &Pose::id);
    if (found != poses->end() && found->id == id) return &*found;
  }
  return nullptr;
}

PoseHistory::Pose PoseHistory::Between(const Pose& from, const Pose* to, double part) const {
  if (to == nullptr || part == 0) return from;
  const Vec3d way = to->position - from.position;
  if (Length(way) > 4 * from.speed_m_s * tick_s_ + kJumpBeyond_m) return from;
  Pose between = from;
  between.position = from.position + way * part;
  const Quatd a = from.orientation;
  Quatd b = to->orientation;
  if (a.x * b.x + a.y * b.y + a.z * b.z + a.w * b.w < 0) b = {-b.x, -b.y, -b.z, -b.w};
  const double rest = 1 - part;
  between.orientation = Normalized(
      Quatd{a.x * rest + b.x * part, a.y * rest + b.y * part, a.z * rest + b.z * part, a.w * rest + b.w * part});
  return between;
}

void PoseHistory::Visit(double at, QueryScope scope, const BodyStore& bodies,
                        absl::FunctionRef<bool(Vec3d middle, double radius_m)> may_meet,
                        absl::FunctionRef<bool(const PastBody&, double radius_m)> visit) const {
  if (frames_.empty()) return;
  double part = 0;
  const std::size_t index = FrameAt(at, &part);
  const Frame& frame = frames_[index];
  const Frame* const after = part > 0 ? &frames_[index + 1] : nullptr;
  const auto each = [&](const std::vector<Pose>& poses) {
    for (const Pose& pose : poses) {
      // As far as the way to the next pose may be.
      const double reach = after == nullptr ? 0 : 4 * pose.speed_m_s * tick_s_ + kJumpBeyond_m;
      if (!may_meet(pose.position, pose.radius_m + reach)) continue;
      const Pose was = Between(pose, after == nullptr ? nullptr : Find(*after, pose.id), part);
      PastBody past{.id = pose.id, .position = was.position, .orientation = was.orientation};
      if (const RigidBody* const body = bodies.Find(pose.id); body != nullptr) {
        past.geometry = &body->geometry();
        past.layer = body->layer().index;
        past.dynamic = body->dynamic();
        past.trigger = body->trigger();
      } else if (const auto gone = gone_.find(pose.id); gone != gone_.end()) {
        past.geometry = gone->second.geometry.get();
        past.layer = gone->second.layer;
        past.dynamic = gone->second.dynamic;
        past.trigger = gone->second.trigger;
      } else {
        continue;
      }
      if (!visit(past, pose.radius_m)) return false;
    }
    return true;
  };
  if (!each(frame.own)) return;
  if (scope == QueryScope::kSeen && !each(frame.ghosts)) return;
  if (scope != QueryScope::kOwned) each(frame.fixed);
}

}  // namespace tessera::physics
