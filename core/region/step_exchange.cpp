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

bool Sane(const physics::PairImpulse& contact) {
  return IsSaneImpulse(contact.impulse_on_b) && IsSaneAngularImpulse(contact.angular_impulse_on_a) &&
         IsSaneAngularImpulse(contact.angular_impulse_on_b);
}

}  // namespace

void RegionStep::NoteContacts() {
  border.clear();
  if (neighbors.empty()) return;
  const std::span<const physics::PairImpulse> contacts = ContactsNearBorders();
  NoteTouching(contacts);
  if (bodies.ghosts().empty()) return;
  const std::size_t own = bodies.owned().size(), all = own + bodies.ghosts().size();
  for (const physics::PairImpulse& contact : contacts) {
    const bool own_a = contact.tag_a < own, own_b = contact.tag_b < own;
    if (own_a == own_b || std::max(contact.tag_a, contact.tag_b) >= all) continue;
    const Ghost& ghost = bodies.ghosts()[(own_a ? contact.tag_b : contact.tag_a) - own];
    if (!OpenTo(ghost.owner) || !Sane(contact)) continue;
    Solution solution{contact.body_a,
                      contact.body_b,
                      own_a,
                      contact.impulse_on_b,
                      contact.angular_impulse_on_a,
                      contact.angular_impulse_on_b};
    solution.other = ghost.owner;
    border.push_back({solution, own_a ? contact.tag_a : contact.tag_b});
  }
}

// Those between bodies and ghosts, and of bodies that are shown to anyone: what happens in the middle of a region, or
// among ghosts, is nobody else's.
std::span<const physics::PairImpulse> RegionStep::ContactsNearBorders() const {
  enum : std::uint8_t { kOwn = 1, kNear = 2 };
  const std::size_t own = bodies.owned().size(), all = own + bodies.ghosts().size();
  if (all < stepped_places_) {
    // Some were taken out since the step: what it has noted are the places of before.
    return bodies.world().ImpulsesOf(std::vector<std::uint8_t>(stepped_places_, kOwn | kNear));
  }
  std::vector<std::uint8_t> bits(all, kNear);
  for (std::size_t i = 0; i < own; ++i) bits[i] = reach.ShowsAny(i) ? kOwn | kNear : kOwn;
  return bodies.world().ImpulsesOf(bits);
}

// One of a pair that touched in the last step, as it is now.
RegionStep::Party RegionStep::PartyOf(BodyId id) const {
  Party party;
  party.id = id;
  party.place = bodies.PlaceOf(id);
  const std::ptrdiff_t own = std::ssize(bodies.owned());
  party.mass_kg = party.place < 0 ? catalog.MassOf(id) : DefAt(static_cast<std::size_t>(party.place)).mass_kg;
  party.gone = FindHandedOut(id);
  if (party.gone != nullptr) {
    party.was_here = true;
    party.slept = party.gone->record.state.asleep;
  } else if (party.place >= 0 && party.place < own) {
    party.told = std::binary_search(taken_in.begin(), taken_in.end(), id);
    party.was_here = !party.told;
    party.slept = bodies.owned()[static_cast<std::size_t>(party.place)].state.asleep;
  } else if (party.place >= 0) {
    const Ghost& ghost = bodies.ghosts()[static_cast<std::size_t>(party.place - own)];
    party.told = ghost.told;
    party.slept = ghost.told && ghost.record.state.asleep;
  }
  return party;
}

void RegionStep::ExchangeImpulses(const Frames& frames) {
  Kicks kicks(bodies.owned().size() + bodies.ghosts().size());
  TakeLateCorrections(frames, kicks);
  const std::vector<Solution> solutions = GatherSolutions(frames);
  for (auto at = solutions.begin(); at != solutions.end();) {
    const Party a = PartyOf(at->a), b = PartyOf(at->b);
    const Solution *of_a = nullptr, *of_b = nullptr;
    RegionId owner_of_a, owner_of_b;
    for (const auto first = at; at != solutions.end() && !Before(*first, *at); ++at) {
      const bool mine = at->teller == RegionId();
      if (!mine && (at->by_owner_of_a ? a : b).was_here) continue;
      (at->by_owner_of_a ? of_a : of_b) = &*at;
      if (mine) (at->by_owner_of_a ? owner_of_b : owner_of_a) = at->other;
    }
    // Who tells of it knows better.
    if (of_a != nullptr && of_a->teller != RegionId()) owner_of_a = of_a->teller;
    if (of_b != nullptr && of_b->teller != RegionId()) owner_of_b = of_b->teller;
    // A sleeper is not solved by its owner: there is nothing to balance.
    if (a.slept || b.slept || (a.was_here && b.was_here)) continue;
    const bool between_others = !a.was_here && !b.was_here;
    if (between_others && !(a.told && b.told)) continue;
    const PairCorrection due = CorrectionOf(of_a, of_b, a.mass_kg, b.mass_kg);
    Settle(a, {due.impulse_on_a, due.angular_on_a, true}, owner_of_b, between_others, kicks);
    Settle(b, {due.impulse_on_b, due.angular_on_b, true}, owner_of_a, between_others, kicks);
  }
  KickBodies(kicks);
}

// A ghost gets its share as well, so that it starts the step as it does with its owner.
void RegionStep::Settle(const Party& party, const Kick& share, RegionId other_owner, bool between_others,
                        Kicks& kicks) {
  if (party.gone != nullptr && party.gone->to != other_owner) {
    SendLate(*party.gone, 1, share.impulse, share.angular);
  } else if (party.place >= 0 && !(between_others && party.place < std::ssize(bodies.owned()))) {
    AddLate(party.place, share, kicks);
  }
}

// Who gets it takes it to be about where the body is a tick and a half before it acts (AddLate). Beyond limits it would
// be refused there, and the frame with it.
void RegionStep::SendLate(const HandedOut& gone, double ticks, Vec3d impulse, Vec3d angular) {
  const Vec3d moved = Vec3d(gone.record.state.linear_velocity) * (ticks * tick_s);
  const LateCorrection late{gone.record.id, Vec3f(impulse), Vec3f(angular - Cross(moved, impulse))};
  if (!IsSaneImpulse(late.impulse_ns) || !IsSaneAngularImpulse(late.angular_nms)) return;
  if (Outbox* box = OutboxTo(gone.to); box != nullptr) box->late_corrections.push_back(late);
}

// Sent on to whom the body has gone since.
void RegionStep::TakeLateCorrections(const Frames& frames, Kicks& kicks) {
  for (const Frame& frame : frames) {
    for (const LateCorrection& late : frame.late_corrections) {
      if (const HandedOut* out = FindHandedOut(late.id); out != nullptr) {
        SendLate(*out, 1, Vec3d(late.impulse_ns), Vec3d(late.angular_nms));
      } else if (const std::ptrdiff_t index = bodies.IndexOf(late.id); index >= 0) {
        AddLate(index, {Vec3d(late.impulse_ns), Vec3d(late.angular_nms), false}, kicks);
      }
    }
  }
}

// This region's and the neighbours', ascending by pair.
std::vector<Solution> RegionStep::GatherSolutions(const Frames& frames) const {
  std::vector<Solution> solutions;
  solutions.reserve(3 * border.size());
  for (const BorderContact& contact : border) {
    if (OpenTo(contact.solution.other)) solutions.push_back(contact.solution);  // it may have closed since
  }
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const auto middle = std::ssize(solutions);
    for (const ImpulseRecord& record : frames[i].impulses) {
      solutions.push_back(ToSolution(record));
      solutions.back().teller = neighbors[i];
    }
    std::inplace_merge(solutions.begin(), solutions.begin() + middle, solutions.end(), Before);
  }
  return solutions;
}

const BodyState& RegionStep::StartOf(std::size_t place) const {
  const std::size_t own = bodies.owned().size();
  return place < own ? bodies.owned()[place].state : bodies.ghosts()[place - own].record.state;
}

const BodyDef& RegionStep::DefAt(std::size_t place) const {
  const std::size_t own = bodies.owned().size();
  return place < own ? *bodies.owned()[place].def : *bodies.ghosts()[place - own].def;
}

// A contact acts where bodies are at the start of its step, a force where they are half way through the next.
void RegionStep::AddLate(std::ptrdiff_t place, Kick share, Kicks& kicks) const {
  constexpr double kLateTicks = 1.5;
  const auto at = static_cast<std::size_t>(place);
  share.angular -= Cross(Vec3d(StartOf(at).linear_velocity) * (kLateTicks * tick_s), share.impulse);
  if (!kicks[at].has_value()) kicks[at].emplace();
  *kicks[at] += share;
}

// Over the whole tick, as a force: what lies in a pile would be thrown off its support by a blow, and a pile that is
// thrown about in every tick asks for twice the substeps. What still touches another's body gets a tenth of what it is
// due, and of the rest in the next tick: each side answers at once to what it is given, and all of it goes to and fro
// between them. What has parted gets all of it, before it is elsewhere.
void RegionStep::KickBodies(Kicks& kicks) {
  constexpr double kAtOnce = 0.1, kLeast_m_s = 1e-9;
  for (const OwedImpulse& rest : std::exchange(owed, {})) {
    const std::ptrdiff_t place = bodies.PlaceOf(rest.id);
    if (place < 0) continue;
    const auto at = static_cast<std::size_t>(place);
    if (!kicks[at].has_value()) kicks[at].emplace();
    const Vec3d moved = StartOf(at).position - rest.at;
    *kicks[at] += {rest.impulse_ns, rest.angular_nms - Cross(moved, rest.impulse_ns), false};
  }
  for (std::size_t place = 0; place < kicks.size(); ++place) {
    if (!kicks[place].has_value()) continue;
    const BodyDef& def = DefAt(place);
    Kick kick = *kicks[place];
    BodyState state = bodies.world().StateOf(def.id);
    if (state.asleep) continue;
    const bool by_and_by = kick.touches && Length(kick.impulse) > kLeast_m_s * def.mass_kg;
    const OwedImpulse rest{def.id, kick.impulse * (1 - kAtOnce), kick.angular * (1 - kAtOnce), state.position};
    if (by_and_by) kick = {kick.impulse * kAtOnce, kick.angular * kAtOnce, true};
    state.linear_velocity += Vec3f(kick.impulse / def.mass_kg);
    state.angular_momentum += Vec3f(kick.angular);
    const Vec3f force(kick.impulse / tick_s), torque(kick.angular / tick_s);
    if (!IsSane(state) || !CheckForce(def.id, force, torque).ok()) continue;
    bodies.world().ApplyForce(def.id, force, torque);
    if (by_and_by) owed.push_back(rest);
  }
}

}  // namespace tessera::region
