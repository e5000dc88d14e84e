#include "core/physics/contacts.h"

#include <algorithm>
#include <limits>
#include <tuple>

#include "core/physics/bullet_math.h"
#include "core/physics/tuning.h"

namespace tessera::physics {
namespace {

float Distance(const btPersistentManifold& manifold) {
  float nearest = std::numeric_limits<float>::max();
  for (int i = 0; i < manifold.getNumContacts(); ++i)
    nearest = std::min(nearest, manifold.getContactPoint(i).getDistance());
  return nearest;
}

// The points of one pair, which may lie in several manifolds.
struct Sum {
  btVector3 points{0, 0, 0}, deepest_normal{0, 0, 0};
  int count = 0;
  float depth = -std::numeric_limits<float>::max();
  btVector3 impulse{0, 0, 0}, angular_a{0, 0, 0}, angular_b{0, 0, 0};

  void Add(const Touch& touch, const ManifoldImpulse& applied) {
    const bool in_order = Body::Of(*touch.manifold->getBody0()).id() == touch.low;
    for (int i = 0; i < touch.manifold->getNumContacts(); ++i) {
      const btManifoldPoint& p = touch.manifold->getContactPoint(i);
      points += (p.getPositionWorldOnA() + p.getPositionWorldOnB()) * btScalar(0.5);
      ++count;
      if (-p.getDistance() <= depth) continue;
      depth = -p.getDistance();
      deepest_normal = in_order ? -p.m_normalWorldOnB : p.m_normalWorldOnB;  // Bullet's points from body1 to body0
    }
    impulse += in_order ? applied.on_body1 : -applied.on_body1;
    angular_a += in_order ? applied.angular_on_body0 : applied.angular_on_body1;
    angular_b += in_order ? applied.angular_on_body1 : applied.angular_on_body0;
  }
};

}  // namespace

void SummarizeContacts(std::span<const Touch> solved, std::span<const ManifoldImpulse> impulses, Vec3d origin,
                       std::vector<Contact>* out) {
  out->clear();
  for (std::size_t i = 0; i < solved.size();) {
    const BodyId low = solved[i].low, high = solved[i].high;
    Sum sum;
    for (; i < solved.size() && solved[i].low == low && solved[i].high == high; ++i) sum.Add(solved[i], impulses[i]);
    out->push_back({.body_a = low,
                    .body_b = high,
                    .point = origin + Vec3d(FromBullet(sum.points / static_cast<btScalar>(sum.count))),
                    .normal = FromBullet(sum.deepest_normal),
                    .depth_m = sum.depth,
                    .impulse_on_b = FromBullet(sum.impulse),
                    .angular_impulse_on_a = FromBullet(sum.angular_a),
                    .angular_impulse_on_b = FromBullet(sum.angular_b)});
  }
}

bool PairWatch::Before(const Pair& a, const Pair& b) { return std::tie(a.low, a.high) < std::tie(b.low, b.high); }

void PairWatch::Update(std::span<const Touch> touches, std::vector<PairEvent>* events) {
  next_.clear();
  events->clear();
  std::size_t old = 0;
  const auto end_before = [&](const Pair* limit) {
    for (; old < touching_.size() && (limit == nullptr || Before(touching_[old], *limit)); ++old) {
      events->push_back({touching_[old].low, touching_[old].high, touching_[old].trigger, false});
    }
  };
  for (std::size_t i = 0; i < touches.size();) {
    const Pair pair{touches[i].low, touches[i].high, !touches[i].responds};
    float distance = std::numeric_limits<float>::max();
    for (; i < touches.size() && touches[i].low == pair.low && touches[i].high == pair.high; ++i) {
      distance = std::min(distance, Distance(*touches[i].manifold));
    }
    end_before(&pair);
    const bool before = old < touching_.size() && !Before(pair, touching_[old]);
    if (before) ++old;
    const bool now = distance <= (before ? kTouchEnd_m : kTouchBegin_m);
    if (now) next_.push_back(pair);
    if (now != before) events->push_back({pair.low, pair.high, pair.trigger, now});
  }
  end_before(nullptr);
  std::swap(touching_, next_);
}

}  // namespace tessera::physics
