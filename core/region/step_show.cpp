// What of a pile is shown to a neighbour beyond what reaches it: what may touch what is the neighbour's, so many
// contacts deep, and all of it if it is small; and, for each body, what those that are not shown do to it.
#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

#include "core/region/step.h"
#include "core/world/state_check.h"

namespace tessera::region {
namespace {

// A load is told as a mean over about so many ticks: told as it is, it comes back a tick later as the answer to itself,
// and a pile trembles for ever. With 10 a pile of 1240 boxes at rest moves by 1 mm/s, with 2.5 by 5 mm/s. More, and it
// takes as long to tell of a load that has changed.
constexpr float kLoadTicks = 10;

// And at most so many times what it did in either of the last two: what a blow left of itself in the mean turns bodies
// long after it. Without, two colliding blocks of 64 in two regions change their angular momentum by 9e-5 of it; with
// 1, 4e-6, since what trembles is told too small; with 2, 5e-7.
constexpr float kMostLoad = 2;

// Of two successive ticks, what lasts.
float Lasting(float before, float now) {
  if ((before > 0) != (now > 0)) return 0;
  return std::abs(before) < std::abs(now) ? before : now;
}
Vec3f Lasting(Vec3f before, Vec3f now) {
  return {Lasting(before.x, now.x), Lasting(before.y, now.y), Lasting(before.z, now.z)};
}

// What a contact does as a load, after what it was told to do and what it did in two successive ticks. A new one begins
// with what lasts.
Vec3f Load(Vec3f told, Vec3f before, Vec3f now) {
  if (told == Vec3f()) return Lasting(before, now);
  const Vec3f mean = told + (now - told) / kLoadTicks;
  const float size = Length(mean), most = kMostLoad * std::max(Length(before), Length(now));
  return size > most ? mean * (most / size) : mean;
}

}  // namespace

void RegionStep::NoteTouching(std::span<const physics::Contact> contacts) {
  std::swap(touching_, touched_before_);
  touching_.clear();
  touching_.reserve(contacts.size());
  auto before = touched_before_.begin();
  const auto behind = [](const Touch& touch, const physics::Contact& contact) {
    return std::tie(touch.a, touch.b) < std::tie(contact.body_a, contact.body_b);
  };
  for (const physics::Contact& contact : contacts) {
    while (before != touched_before_.end() && behind(*before, contact)) ++before;
    const BodyId a = contact.body_a, b = contact.body_b;
    const std::array now{contact.impulse_on_b, contact.angular_impulse_on_a, contact.angular_impulse_on_b};
    Touch& touch = touching_.emplace_back(Touch{a, b, {}, {}, {}, now});
    if (before == touched_before_.end() || before->a != a || before->b != b) continue;
    touch.impulse_on_b = Load(before->impulse_on_b, before->now[0], now[0]);
    touch.angular_on_a = Load(before->angular_on_a, before->now[1], now[1]);
    touch.angular_on_b = Load(before->angular_on_b, before->now[2], now[2]);
  }
}

// What is about it; before the first step nothing has been looked for yet.
void RegionStep::AddNear(BodyId id, std::vector<BodyId>* near) const {
  constexpr double kAbout_m = 0.1;
  const physics::World& world = bodies.world();
  if (stepped_) return world.AddNear(id, near);
  const std::vector<BodyId> found = world.Overlapping(world.BoundsOf(id).Expanded(kAbout_m));
  near->insert(near->end(), found.begin(), found.end());
}

// What may soon touch a neighbour's body, or one that becomes the neighbour's, is shown to it whatever its place; so it
// is to whom the body lies with, if that is another.
void RegionStep::ShowNear() {
  std::vector<BodyId> near;
  const auto show_about = [&](BodyId id, RegionId owner) {
    const std::ptrdiff_t to = NeighborIndex(owner);
    const std::ptrdiff_t at = NeighborIndex(config.map.OwnerOf(bodies.world().StateOf(id).position));
    near.clear();
    AddNear(id, &near);
    for (const BodyId other : near) {
      const std::ptrdiff_t index = bodies.IndexOf(other);
      if (index < 0) continue;
      if (to >= 0) reach.Show(static_cast<std::size_t>(index), static_cast<std::size_t>(to));
      if (at >= 0) reach.Show(static_cast<std::size_t>(index), static_cast<std::size_t>(at));
    }
  };
  for (const Ghost& ghost : bodies.ghosts()) show_about(ghost.record.id, ghost.owner);
  for (const HandedOut& out : handed_out) show_about(out.record.id, out.to);
}

// Layer by layer, from what moves: what lies still is held by the loads that are told of it.
void RegionStep::ShowDeeper() {
  if (config.settings.ghost_depth == 0 || !reach.ShowsAnything()) return;
  const auto moves = [this](std::size_t body) {
    return bodies.extras()[body].still_ticks < kCalmTicks && !bodies.owned()[body].state.asleep;
  };
  std::vector<std::size_t> edge, next;
  std::vector<BodyId> near;
  for (std::size_t n = 0; n < neighbors.size(); ++n) {
    edge.clear();
    for (std::size_t i = 0; i < bodies.owned().size(); ++i) {
      if (reach.Shows(i, n) && moves(i)) edge.push_back(i);
    }
    for (std::uint32_t layer = 0; layer < config.settings.ghost_depth && !edge.empty(); ++layer) {
      next.clear();
      for (const std::size_t body : edge) {
        near.clear();
        AddNear(bodies.owned()[body].def->id, &near);
        for (const BodyId other : near) {
          const std::ptrdiff_t index = bodies.IndexOf(other);
          if (index < 0 || reach.Shows(static_cast<std::size_t>(index), n)) continue;
          reach.Show(static_cast<std::size_t>(index), n);
          if (moves(static_cast<std::size_t>(index))) next.push_back(static_cast<std::size_t>(index));
        }
      }
      std::swap(edge, next);
    }
  }
}

void RegionStep::NoteStill() {
  for (std::size_t i = 0; i < bodies.owned().size(); ++i) {
    const BodyState& state = bodies.owned()[i].state;
    OwnedExtra& extra = bodies.extras()[i];
    const auto moves = [&] {
      const float rim_m_s = Length(state.angular_velocity) * static_cast<float>(extra.radius_m);
      return Length(state.linear_velocity) + rim_m_s > kCalm_m_s;
    };
    const bool still = reach.ShowsAny(i) && !moves();
    extra.still_ticks = still ? std::min<std::uint8_t>(extra.still_ticks + 1, kCalmTicks) : std::uint8_t{0};
  }
}

// Players start without warning. What is shown as a whole is solved as a whole.
bool RegionStep::IsCalm(std::size_t index) const {
  const OwnedBody& body = bodies.owned()[index];
  return bodies.extras()[index].still_ticks >= kCalmTicks && !body.state.asleep && !whole_[index] &&
         !IsPlayerBody(body.def->id);
}

// To whom any of it comes near, so that around a corner and over a narrow region all who have part in it see all of it.
void RegionStep::ShowAround(std::span<const std::size_t> whole) {
  constexpr double kAround_m = 1;  // more than bodies overhang their owners' cells, as a rule
  for (const std::size_t body : whole) {
    const Aabb box = bodies.world().BoundsOf(bodies.owned()[body].def->id).Expanded(kAround_m);
    for (std::size_t n = 0; n < neighbors.size(); ++n) {
      if (!reach.Shows(body, n) && config.map.Reaches(neighbors[n], box)) reach.Show(body, n);
    }
  }
}

// Before the first step nobody has told what lies between this region's bodies: they may hang together by others. A few
// are all shown, of more what is near a border.
void RegionStep::ShowFirst() {
  std::vector<std::size_t> all(bodies.owned().size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  ShowAround(all);
  constexpr std::size_t kFew = 256;
  for (std::size_t n = 0; all.size() <= kFew && n < neighbors.size(); ++n) {
    for (const std::size_t body : all) reach.Show(body, n);
  }
}

// Whose bounds are about each other's hang together, be it through bodies of others; so do the bodies of an assembly. A
// region that has little of it shows it all to whom it shows any: then all solve the same, and come to the same. The
// search ends where it has found too many, or comes to what hangs together with too many.
void RegionStep::ShowWhole() {
  whole_.assign(bodies.owned().size(), false);
  if (config.settings.whole_up_to < 2 || !reach.ShowsAnything()) return;
  const std::size_t own = bodies.owned().size();
  enum : std::uint8_t { kUnknown, kFound, kTooMany };
  std::vector<std::uint8_t> known(own + bodies.ghosts().size(), kUnknown);  // by Bodies::PlaceOf
  std::vector<std::size_t> found, whole;
  std::vector<BodyId> near;
  for (std::size_t first = 0; first < own; ++first) {
    if (known[first] != kUnknown || !reach.ShowsAny(first)) continue;
    found.assign(1, first);
    whole.clear();
    known[first] = kFound;
    bool too_many = false;
    for (std::size_t next = 0; next < found.size() && !too_many; ++next) {
      const std::size_t body = found[next];
      const BodyId id = body < own ? bodies.owned()[body].def->id : bodies.ghosts()[body - own].record.id;
      if (body < own) whole.push_back(body);
      near.assign(catalog.AssemblyOf(id).begin(), catalog.AssemblyOf(id).end());
      AddNear(id, &near);
      for (const BodyId other : near) {
        const std::ptrdiff_t index = bodies.PlaceOf(other);
        if (index < 0 || known[static_cast<std::size_t>(index)] == kFound) continue;
        too_many = too_many || known[static_cast<std::size_t>(index)] == kTooMany;
        known[static_cast<std::size_t>(index)] = kFound;
        found.push_back(static_cast<std::size_t>(index));
      }
      too_many = too_many || whole.size() > config.settings.whole_up_to;
    }
    if (too_many) {
      for (const std::size_t index : found) known[index] = kTooMany;
    } else {
      ShowAround(whole);
      reach.Unite(whole);
      for (const std::size_t body : whole) whole_[body] = true;
    }
  }
}

// A static body is everywhere. Whether a third region shows its body to this neighbour is not known here: it is taken
// to, if the body reaches the neighbour's cells.
void RegionStep::AddLoads(Frame& frame, std::size_t neighbor) const {
  if (frame.ghosts.empty()) return;
  const auto find = [&](BodyId id) {
    const auto it = std::lower_bound(frame.ghosts.begin(), frame.ghosts.end(), id,
                                     [](const GhostRecord& ghost, BodyId wanted) { return ghost.id < wanted; });
    return it != frame.ghosts.end() && it->id == id ? &*it : nullptr;
  };
  const auto is_calm = [&](BodyId id, const GhostRecord* shown) {
    if (shown != nullptr) return shown->calm;
    const Ghost* ghost = bodies.FindGhost(id);
    return ghost != nullptr && ghost->record.calm && ghost->owner != neighbors[neighbor];
  };
  const auto sees = [&](BodyId id, const GhostRecord* shown) {
    if (shown != nullptr) return true;
    if (bodies.Owns(id)) {
      const HandedOut* out = FindHandedOut(id);
      return out != nullptr && out->to == neighbors[neighbor];
    }
    const Ghost* ghost = bodies.FindGhost(id);
    return ghost == nullptr || ghost->owner == neighbors[neighbor] ||
           config.map.Reaches(neighbors[neighbor], bodies.world().BoundsOf(id).Expanded(config.settings.aura_m));
  };
  const auto is_whole = [this](BodyId id) {
    const std::ptrdiff_t index = bodies.IndexOf(id);
    return index >= 0 && whole_[static_cast<std::size_t>(index)];
  };
  for (const Touch& touch : touching_) {
    if (is_whole(touch.a) || is_whole(touch.b)) continue;  // so all of it is seen, whoever shows it
    GhostRecord *a = find(touch.a), *b = find(touch.b);
    const bool calm = is_calm(touch.a, a) && is_calm(touch.b, b);
    if (a != nullptr && (calm || !sees(touch.b, b))) {
      a->load_ns -= touch.impulse_on_b;
      a->load_nms += touch.angular_on_a;
    }
    if (b != nullptr && (calm || !sees(touch.a, a))) {
      b->load_ns += touch.impulse_on_b;
      b->load_nms += touch.angular_on_b;
    }
  }
  for (GhostRecord& ghost : frame.ghosts) {
    if (!ghost.state.asleep && IsSaneImpulse(ghost.load_ns) && IsSaneAngularImpulse(ghost.load_nms)) continue;
    ghost.load_ns = ghost.load_nms = Vec3f();
  }
}

}  // namespace tessera::region
