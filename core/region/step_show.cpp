// What of a pile is shown to a neighbour beyond what reaches it: what may touch what is the neighbour's, so many
// contacts deep, and all of it if it is small; and, for each body, what those that are not shown do to it.
#include <algorithm>
#include <cmath>
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
  const float size_2 = Dot(mean, mean);
  const float most_2 = kMostLoad * kMostLoad * std::max(Dot(before, before), Dot(now, now));
  return size_2 > most_2 ? mean * std::sqrt(most_2 / size_2) : mean;
}

}  // namespace

void RegionStep::NoteTouching(std::span<const physics::PairImpulse> contacts) {
  std::swap(touching_, touched_before_);
  touching_.clear();
  touching_.reserve(contacts.size());
  auto before = touched_before_.begin();
  const auto behind = [](const Touch& touch, const physics::PairImpulse& contact) {
    return std::tie(touch.a, touch.b) < std::tie(contact.body_a, contact.body_b);
  };
  for (const physics::PairImpulse& contact : contacts) {
    while (before != touched_before_.end() && behind(*before, contact)) ++before;
    const BodyId a = contact.body_a, b = contact.body_b;
    const std::array now{contact.impulse_on_b, contact.angular_impulse_on_a, contact.angular_impulse_on_b};
    Touch& touch = touching_.emplace_back(Touch{a, b, contact.tag_a, contact.tag_b, {}, {}, {}, now});
    if (before == touched_before_.end() || before->a != a || before->b != b) continue;
    touch.impulse_on_b = Load(before->impulse_on_b, before->now[0], now[0]);
    touch.angular_on_a = Load(before->angular_on_a, before->now[1], now[1]);
    touch.angular_on_b = Load(before->angular_on_b, before->now[2], now[2]);
  }
}

// Places of what is about it, kNoTag of what is static; before the first step nothing has been looked for yet.
void RegionStep::AddNear(BodyId id, std::vector<std::uint32_t>* near) const {
  constexpr double kAbout_m = 0.1;
  const physics::World& world = bodies.world();
  if (stepped_) return world.AddNear(id, near);
  for (const BodyId found : world.Overlapping(world.BoundsOf(id).Expanded(kAbout_m))) {
    near->push_back(static_cast<std::uint32_t>(bodies.PlaceOf(found)));  // -1: kNoTag
  }
}

// What may soon touch a neighbour's body, or one that becomes the neighbour's, is shown to it whatever its place; so it
// is to whom the body lies with, if that is another.
void RegionStep::ShowNear() {
  std::vector<std::uint32_t> near;
  const auto show_about = [&](BodyId id, RegionId owner) {
    const std::ptrdiff_t to = NeighborIndex(owner);
    const std::ptrdiff_t at = NeighborIndex(config.map.OwnerOf(bodies.world().StateOf(id).position));
    near.clear();
    AddNear(id, &near);
    for (const std::uint32_t other : near) {
      if (other >= bodies.owned().size()) continue;
      if (to >= 0) reach.Show(other, static_cast<std::size_t>(to));
      if (at >= 0) reach.Show(other, static_cast<std::size_t>(at));
    }
  };
  for (const Ghost& ghost : bodies.ghosts()) show_about(ghost.record.id, ghost.owner);
  for (const HandedOut& out : handed_out) show_about(out.record.id, out.to);
}

// Layer by layer along contacts, from what moves: what lies still is held by the loads that are told of it.
void RegionStep::ShowDeeper() {
  if (config.settings.ghost_depth == 0 || !stepped_ || !reach.ShowsAnything()) return;
  const auto moves = [this](std::size_t body) {
    return bodies.extras()[body].still_ticks < kCalmTicks && !bodies.owned()[body].state.asleep;
  };
  std::vector<std::size_t> edge, next;
  std::vector<std::uint32_t> touching;
  for (std::size_t n = 0; n < neighbors.size(); ++n) {
    edge.clear();
    for (std::size_t i = 0; i < bodies.owned().size(); ++i) {
      if (reach.Shows(i, n) && moves(i)) edge.push_back(i);
    }
    for (std::uint32_t layer = 0; layer < config.settings.ghost_depth && !edge.empty(); ++layer) {
      next.clear();
      for (const std::size_t body : edge) {
        touching.clear();
        bodies.world().AddTouching(bodies.owned()[body].def->id, &touching);
        for (const std::uint32_t other : touching) {
          if (other >= bodies.owned().size() || reach.Shows(other, n)) continue;
          reach.Show(other, n);
          if (moves(other)) next.push_back(other);
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

// To whom something comes near that lies within `bounds` and hangs together with `body`.
void RegionStep::ShowAround(std::size_t body, const Aabb& bounds) {
  constexpr double kAround_m = 1;  // more than bodies overhang their owners' cells, as a rule
  const Aabb box = bounds.Expanded(kAround_m);
  for (std::size_t n = 0; n < neighbors.size(); ++n) {
    if (!reach.Shows(body, n) && config.map.Reaches(neighbors[n], box)) reach.Show(body, n);
  }
}

// Before the first step nobody has told what lies between this region's bodies: they may hang together by others. A few
// are all shown, of more what is near a border.
void RegionStep::ShowFirst() {
  constexpr std::size_t kFew = 256;
  const std::size_t own = bodies.owned().size();
  for (std::size_t body = 0; body < own; ++body) {
    ShowAround(body, bodies.world().BoundsOf(bodies.owned()[body].def->id));
    for (std::size_t n = 0; own <= kFew && n < neighbors.size(); ++n) reach.Show(body, n);
  }
}

// Whose bounds are about each other's hang together, be it through bodies of others; so do the bodies of an assembly. A
// region that has little of it shows it all to whom it shows any, and to whom any of it comes near, whoever owns that:
// around a corner, over a narrow region or a bridge that is a third's, all who have part in it see all of it. Then all
// solve the same, and come to the same. So they do, whatever its size, where all of it is near the border anyway. The
// search ends where it has found too many, or comes to what hangs together with too many.
void RegionStep::ShowWhole() {
  whole_.assign(bodies.owned().size(), false);
  if (config.settings.whole_up_to < 2 || !reach.ShowsAnything()) return;
  const std::size_t own = bodies.owned().size();
  enum : std::uint8_t { kUnknown, kFound, kTooMany };
  std::vector<std::uint8_t> known(own + bodies.ghosts().size(), kUnknown);  // by Bodies::PlaceOf
  std::vector<std::size_t> found, whole;
  std::vector<std::uint32_t> near;
  const auto id_of = [&](std::size_t place) {
    return place < own ? bodies.owned()[place].def->id : bodies.ghosts()[place - own].record.id;
  };
  for (std::size_t first = 0; first < own; ++first) {
    if (known[first] != kUnknown || !reach.ShowsAny(first)) continue;
    found.assign(1, first);
    whole.clear();
    known[first] = kFound;
    bool too_many = false, seen_anyway = true;
    for (std::size_t next = 0; next < found.size() && !too_many; ++next) {
      const std::size_t body = found[next];
      const BodyId id = id_of(body);
      if (body < own) {
        whole.push_back(body);
        seen_anyway = seen_anyway && reach.ShowsAlike(first, body);
      }
      near.clear();
      if (!config.scene->joints.empty()) {
        for (const BodyId tied : catalog.AssemblyOf(id)) {
          near.push_back(static_cast<std::uint32_t>(bodies.PlaceOf(tied)));  // -1: kNoTag
        }
      }
      AddNear(id, &near);
      for (const std::uint32_t other : near) {
        if (other >= known.size() || known[other] == kFound) continue;
        too_many = too_many || known[other] == kTooMany;
        known[other] = kFound;
        found.push_back(other);
      }
      too_many = too_many || (whole.size() > config.settings.whole_up_to && !seen_anyway);
    }
    if (too_many) {
      for (const std::size_t index : found) known[index] = kTooMany;
    } else {
      // What is whole because all of it is seen anyway is not shown to more.
      if (whole.size() <= config.settings.whole_up_to) {
        for (const std::size_t body : found) ShowAround(first, bodies.world().BoundsOf(id_of(body)));
        reach.Unite(whole);
      }
      for (const std::size_t body : whole) whole_[body] = true;
    }
  }
}

// A static body is everywhere. Whether a third region shows its body to this neighbour is not known here: it is taken
// to, if the body reaches the neighbour's cells. `shown`: by owned body, where it is in frame.ghosts, or kNotShown.
void RegionStep::AddLoads(Frame& frame, std::span<const std::uint32_t> shown, std::size_t neighbor) const {
  if (frame.ghosts.empty()) return;
  const RegionId to = neighbors[neighbor];
  const std::size_t own = bodies.owned().size();
  // Of a pair, what this neighbour sees of one.
  struct View {
    GhostRecord* shown = nullptr;
    bool calm = false, seen = false;
  };
  const auto view_of = [&](BodyId id, std::uint32_t place) {
    if (place == physics::kNoTag) return View{nullptr, false, true};
    if (place < own) {
      if (const std::uint32_t at = shown[place]; at != kNotShown)
        return View{&frame.ghosts[at], frame.ghosts[at].calm, true};
      const HandedOut* out = FindHandedOut(id);
      return View{nullptr, false, out != nullptr && out->to == to};
    }
    const Ghost& ghost = bodies.ghosts()[place - own];
    if (ghost.owner == to) return View{nullptr, false, true};
    const bool reaches = config.map.Reaches(to, bodies.world().BoundsOf(id).Expanded(config.settings.aura_m));
    return View{nullptr, ghost.record.calm, reaches};
  };
  const auto is_whole = [&](std::uint32_t place) { return place < own && whole_[place]; };
  const auto is_shown = [&](std::uint32_t place) { return place < own && shown[place] != kNotShown; };
  for (const Touch& touch : touching_) {
    if (!is_shown(touch.place_a) && !is_shown(touch.place_b)) continue;
    if (is_whole(touch.place_a) || is_whole(touch.place_b)) continue;  // so all of it is seen, whoever shows it
    const View a = view_of(touch.a, touch.place_a), b = view_of(touch.b, touch.place_b);
    const bool calm = a.calm && b.calm;
    if (a.shown != nullptr && (calm || !b.seen)) {
      a.shown->propped = true;
      a.shown->load_ns -= touch.impulse_on_b;
      a.shown->load_nms += touch.angular_on_a;
    }
    if (b.shown != nullptr && (calm || !a.seen)) {
      b.shown->propped = true;
      b.shown->load_ns += touch.impulse_on_b;
      b.shown->load_nms += touch.angular_on_b;
    }
  }
  for (GhostRecord& ghost : frame.ghosts) {
    if (ghost.state.asleep) ghost.propped = false;
    if (ghost.propped) ghost.island_load = bodies.world().IslandLoadOf(ghost.id);
    if (ghost.propped && IsSaneImpulse(ghost.load_ns) && IsSaneAngularImpulse(ghost.load_nms)) continue;
    ghost.load_ns = ghost.load_nms = Vec3f();
  }
}

}  // namespace tessera::region
