// The part of a tick that keeps momentum across borders. Who applies what to a body that changes hands between the
// contact and its settlement is a rule that both regions can tell without asking: its new owner, if that owned the
// other body and so has both solutions; otherwise the old owner settles and sends the new one what is due, a tick
// later. So each share acts exactly once.
#include <algorithm>
#include <utility>

#include "core/region/step.h"
#include "core/world/state_check.h"

namespace tessera::region {
namespace {

// What a frame tells of a body; null if it is not told of.
const BodyState* Told(const Frame& frame, BodyId id) {
  const auto it = std::lower_bound(frame.ghosts.begin(), frame.ghosts.end(), id,
                                   [](const GhostRecord& ghost, BodyId wanted) { return ghost.id < wanted; });
  if (it != frame.ghosts.end() && it->id == id) return &it->state;
  for (const Grant& grant : frame.grants) {
    for (const GrantedBody& body : grant.bodies) {
      if (body.id == id) return &body.state;
    }
  }
  return nullptr;
}

const BodyState* Told(const std::vector<Frame>& frames, BodyId id) {
  for (const Frame& frame : frames) {
    if (const BodyState* state = Told(frame, id); state != nullptr) return state;
  }
  return nullptr;
}

bool Sane(const physics::Contact& contact) {
  return IsSaneImpulse(contact.impulse_on_b) && IsSaneAngularImpulse(contact.angular_impulse_on_a) &&
         IsSaneAngularImpulse(contact.angular_impulse_on_b);
}

}  // namespace

void RegionStep::NoteContacts() {
  border.clear();
  if (neighbors.empty()) return;
  const std::span<const physics::Contact> contacts = ContactsNearBorders();
  NoteTouching(contacts);
  if (bodies.ghosts().empty()) return;
  for (const physics::Contact& contact : contacts) {
    const BodyId a = contact.body_a, b = contact.body_b;
    const Ghost *ghost_a = bodies.FindGhost(a), *ghost_b = bodies.FindGhost(b);
    if ((ghost_a == nullptr) == (ghost_b == nullptr)) continue;
    if (!OpenTo((ghost_a == nullptr ? ghost_b : ghost_a)->owner)) continue;
    const BodyId own = ghost_a == nullptr ? a : b;
    if (!bodies.Owns(own) || !Sane(contact)) continue;
    const Solution solution{
        a, b, own == a, contact.impulse_on_b, contact.angular_impulse_on_a, contact.angular_impulse_on_b};
    const Ghost& ghost = own == a ? *ghost_b : *ghost_a;
    border.push_back({solution, own, ghost.record.id, ghost.owner});
  }
}

// Those of ghosts, and of bodies that were shown to anyone: what happens in the middle of a region is nobody else's.
std::span<const physics::Contact> RegionStep::ContactsNearBorders() const {
  std::vector<BodyId> near;
  near.reserve(bodies.ghosts().size());
  for (const Ghost& ghost : bodies.ghosts()) near.push_back(ghost.record.id);
  for (const Outbox& box : outboxes_) {
    for (const GhostRecord& told : box.told) {
      if (bodies.world().Has(told.id)) near.push_back(told.id);
    }
  }
  return bodies.world().ContactsOf(near);
}

void RegionStep::ExchangeImpulses(const Frames& frames) {
  Kicks kicks;
  TakeLateCorrections(frames, kicks);
  const auto mass_of = [this](BodyId id) { return catalog.MassOf(id); };
  for (const PairCorrection& pair : CorrectionsOf(GatherSolutions(frames), mass_of)) {
    // A sleeper is not solved by its owner: there is nothing to balance.
    if (Slept(frames, pair.a) || Slept(frames, pair.b)) continue;
    const bool a_here = WasOwned(pair.a), b_here = WasOwned(pair.b);
    if (a_here && b_here) continue;
    const bool between_others = !a_here && !b_here;
    if (between_others && (Told(frames, pair.a) == nullptr || Told(frames, pair.b) == nullptr)) continue;
    // A ghost gets its share as well, so that it starts the step as it does with its owner.
    const auto settle = [&](BodyId id, bool here, RegionId other_owner, const Kick& share) {
      const HandedOut* out = here ? FindHandedOut(id) : nullptr;
      if (out != nullptr && out->to != other_owner) {
        const LateCorrection late{id, Vec3f(share.impulse), Vec3f(share.angular)};
        if (!IsSaneImpulse(late.impulse_ns) || !IsSaneAngularImpulse(late.angular_nms)) return;
        if (Outbox* box = OutboxTo(out->to); box != nullptr) box->late_corrections.push_back(late);
      } else if (bodies.world().Has(id) && !(between_others && bodies.Owns(id))) {
        kicks.emplace_back(id, share);
      }
    };
    settle(pair.a, a_here, pair.owner_of_b, {pair.impulse_on_a, pair.angular_on_a});
    settle(pair.b, b_here, pair.owner_of_a, {pair.impulse_on_b, pair.angular_on_b});
  }
  KickBodies(std::move(kicks));
}

// Sent on to whom the body has gone since.
void RegionStep::TakeLateCorrections(const Frames& frames, Kicks& kicks) {
  for (const Frame& frame : frames) {
    for (const LateCorrection& late : frame.late_corrections) {
      if (const HandedOut* out = FindHandedOut(late.id); out != nullptr) {
        if (Outbox* box = OutboxTo(out->to); box != nullptr) box->late_corrections.push_back(late);
      } else if (bodies.Owns(late.id)) {
        kicks.emplace_back(late.id, Kick{Vec3d(late.impulse_ns), Vec3d(late.angular_nms)});
      }
    }
  }
}

// This region's and the neighbours'; with who owned the bodies of others when they touched.
std::vector<Solution> RegionStep::GatherSolutions(const Frames& frames) const {
  std::vector<Solution> solutions;
  solutions.reserve(3 * border.size());
  for (const BorderContact& contact : border) {
    if (!OpenTo(contact.other_owner)) continue;  // it has closed since
    solutions.push_back(contact.solution);
    (contact.solution.by_owner_of_a ? solutions.back().owner_of_b : solutions.back().owner_of_a) = contact.other_owner;
  }
  for (std::size_t i = 0; i < frames.size(); ++i) {
    for (const ImpulseRecord& record : frames[i].impulses) {
      if (WasOwned(record.own)) continue;
      solutions.push_back(ToSolution(record));
      (solutions.back().by_owner_of_a ? solutions.back().owner_of_a : solutions.back().owner_of_b) = neighbors[i];
    }
  }
  return solutions;
}

// Whether its owner had it asleep after the last step.
bool RegionStep::Slept(const Frames& frames, BodyId id) const {
  if (const HandedOut* out = FindHandedOut(id); out != nullptr) return out->record.state.asleep;
  const std::ptrdiff_t index = WasOwned(id) ? bodies.IndexOf(id) : -1;
  if (index >= 0) return bodies.owned()[static_cast<std::size_t>(index)].state.asleep;
  const BodyState* told = Told(frames, id);
  return told != nullptr && told->asleep;
}

bool RegionStep::LiesStill(BodyId id) const {
  const std::ptrdiff_t index = bodies.IndexOf(id);
  if (index >= 0) return bodies.extras()[static_cast<std::size_t>(index)].still_ticks >= kCalmTicks;
  const Ghost* ghost = bodies.FindGhost(id);
  return ghost != nullptr && ghost->record.calm;
}

// Over the whole tick, as a force: what lies in a pile would be thrown off its support by a blow, and a pile that is
// thrown about in every tick asks for twice the substeps. What lies still gets a quarter of what it is due, and of the
// rest in the next tick: each side answers at once to what it is given, and all of it goes to and fro between them for
// ever.
void RegionStep::KickBodies(Kicks kicks) {
  constexpr double kAtOnce = 0.25, kLeast_m_s = 1e-9;
  // A contact acts where bodies are at the start of its step, a force where they are half way through the next.
  constexpr double kLateTicks = 1.5;
  for (auto& [id, kick] : kicks) {
    const Vec3d velocity(bodies.world().StateOf(id).linear_velocity);
    kick.angular -= Cross(velocity * (kLateTicks * tick_s), kick.impulse);
  }
  for (const auto& [id, owed] : std::exchange(owed_, {})) {
    if (!bodies.world().Has(id)) continue;
    Kick due = owed.kick;
    due.angular += Cross(owed.at - bodies.world().StateOf(id).position, due.impulse);
    kicks.emplace_back(id, due);
  }
  const auto before = [](const auto& a, const auto& b) { return a.first < b.first; };
  std::stable_sort(kicks.begin(), kicks.end(), before);
  for (std::size_t i = 0; i < kicks.size();) {
    const BodyId id = kicks[i].first;
    Kick kick;
    for (; i < kicks.size() && kicks[i].first == id; ++i) kick += kicks[i].second;
    BodyState state = bodies.world().StateOf(id);
    if (state.asleep) continue;
    if (LiesStill(id) && Length(kick.impulse) > kLeast_m_s * bodies.world().MassOf(id)) {
      owed_[id] = {{kick.impulse * (1 - kAtOnce), kick.angular * (1 - kAtOnce)}, state.position};
      kick.impulse = kick.impulse * kAtOnce;
      kick.angular = kick.angular * kAtOnce;
    }
    state.linear_velocity += Vec3f(kick.impulse / bodies.world().MassOf(id));
    state.angular_momentum += Vec3f(kick.angular);
    if (!IsSane(state)) continue;
    bodies.world().ApplyForce(id, Vec3f(kick.impulse / tick_s), Vec3f(kick.angular / tick_s));
  }
}

}  // namespace tessera::region
