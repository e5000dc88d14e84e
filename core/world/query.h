// BodyQuery: a question about where bodies are: which ones a ray meets, or a shape on its way, or a shape where it is.
//
//   BodyQuery ray{.from = eye, .to = eye + look * 100.0};
//   ray.filter.ignored = {self};
//   const QueryResult seen = world.FindBodies(ray);
//
// A ray is the way of a point; an overlap is the way of a shape whose ends are the same. Question and answer are plain
// data without a place of their own, so that a question can be put to several regions and their hits merged: hits of
// one question are ordered by (fraction, body), whoever found them.
//
// Thread rule: plain values.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <variant>
#include <vector>

#include "core/world/ids.h"
#include "core/world/math.h"
#include "core/world/scene.h"

namespace tessera {

// The bodies that a query sees. All conditions hold for each of them.
struct QueryFilter {
  std::uint32_t layers = ~0u;  // bit i: bodies of the scene's layer i
  bool static_bodies = true, dynamic_bodies = true;
  bool triggers = false;
  std::vector<BodyId> ignored{};  // in any order
};

struct PointProbe {};  // the way of a point is a ray
using QueryShape = std::variant<PointProbe, SphereShape, CapsuleShape, BoxShape>;

// Whether a query sees a body that passes its filter; null: all of them.
using BodyPredicate = std::function<bool(BodyId)>;

// Which bodies answer a query that looks back: all that the region sees; those that it owned, and all that is nobody's;
// or those that it owned alone. So the answers of all regions together name each body once.
enum class QueryScope : std::uint8_t { kSeen, kOwnedAndFixed, kOwned };

// How far back a query may look, s of the world: longer than the way from a player's screen to a region mostly takes.
// More, and who was hit has been behind a wall for longer.
inline constexpr double kMaxLookBack_s = 0.4;

struct BodyQuery {
  QueryShape shape{};
  Quatd orientation{};  // the shape's, unit; it does not turn on its way
  Vec3d from{}, to{};   // way of the shape's middle, finite
  QueryFilter filter{};
  std::size_t most_hits = 1;  // the first ones along the way; each body is hit once
  // The query is given up once it needs more work than this, in instructions of a game (some 5 ns each).
  std::uint64_t most_work = std::numeric_limits<std::uint64_t>::max();
  // Bodies that may move are where they were at this moment, a tick and a part of one, as far as that is known; without
  // it where the last step left them.
  std::optional<double> at_tick{};
  QueryScope scope = QueryScope::kSeen;
};

// Where the shape first touches a body. A shape that touches it from the beginning has fraction 0, `from` as its point
// and a normal against its way, which is 0 where there is no way. So does a ray that begins inside of a body. A mesh
// and a height field are surfaces without an inside; they are hit from both sides.
struct QueryHit {
  BodyId body;
  double fraction = 0;  // share of the way, 0 to 1
  Vec3d point;          // on the body's surface, world space, m
  Vec3d normal;         // unit, out of the body towards the shape
};

struct QueryResult {
  std::vector<QueryHit> hits;  // ascending by (fraction, body); empty unless complete
  // Spent, at most `most_work`; it follows from the bodies and the question alone, not from how the world was built.
  std::uint64_t work = 0;
  bool complete = true;  // false: it was given up
  bool known = true;     // false: where the bodies were at that moment is not known here
};

}  // namespace tessera
