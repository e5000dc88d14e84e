#include "core/region/impulse_exchange.h"

#include <algorithm>
#include <cassert>

#include "core/region/ascends.h"
#include "core/world/state_check.h"

namespace tessera::region {
namespace {

bool IsSane(const physics::PairImpulse& contact) {
  return IsSaneImpulse(contact.impulse_on_b) && IsSaneAngularImpulse(contact.angular_impulse_on_a) &&
         IsSaneAngularImpulse(contact.angular_impulse_on_b);
}

}  // namespace

void ImpulseExchange::Correction::operator+=(const Correction& more) {
  impulse += more.impulse, angular += more.angular;
  touches = touches || more.touches;
}

void ImpulseExchange::Note(std::span<const physics::PairImpulse> contacts, const Bodies& bodies,
                           std::span<const RegionId> links_up) {
  border_.clear();
  const std::size_t own = bodies.owned().size(), all = bodies.places();
  if (own == all) return;
  for (const physics::PairImpulse& contact : contacts) {
    const bool own_a = contact.tag_a < own, own_b = contact.tag_b < own;
    if (own_a == own_b || std::max(contact.tag_a, contact.tag_b) >= all) continue;
    // No impulse changes how a kinematic body moves: the other body's owner knows all of it.
    if (bodies.DefAt(contact.tag_a).kinematic || bodies.DefAt(contact.tag_b).kinematic) continue;
    const RegionId other = bodies.ghosts()[(own_a ? contact.tag_b : contact.tag_a) - own].owner;
    if (!std::binary_search(links_up.begin(), links_up.end(), other) || !IsSane(contact)) continue;
    Solution solution{contact.body_a,
                      contact.body_b,
                      own_a,
                      contact.impulse_on_b,
                      contact.angular_impulse_on_a,
                      contact.angular_impulse_on_b};
    solution.other = other;
    border_.push_back({solution, own_a ? contact.tag_a : contact.tag_b});
  }
}

std::vector<ImpulseRecord> ImpulseExchange::RecordsFor(RegionId neighbor,
                                                       absl::FunctionRef<bool(std::size_t)> is_sent) const {
  std::vector<ImpulseRecord> records;
  for (const BorderContact& contact : border_) {
    const Solution& s = contact.solution;
    if (s.other != neighbor && !is_sent(contact.own)) continue;
    const bool own_a = s.by_owner_of_a;
    records.push_back({own_a ? s.a : s.b, own_a ? s.b : s.a, own_a ? -s.impulse_on_b : s.impulse_on_b,
                       own_a ? s.angular_on_a : s.angular_on_b, own_a ? s.angular_on_b : s.angular_on_a});
  }
  return records;
}

std::optional<ImpulseExchange::AddressedCorrection> ImpulseExchange::PassOn(const DepartingBody& body) {
  const auto rest = std::ranges::find(owed_, body.record.id, &OwedImpulse::id);
  if (rest == owed_.end()) return std::nullopt;
  const OwedImpulse owed = *rest;
  owed_.erase(rest);
  // It is for where the body will be in a tick; the receiver takes it to be a tick and a half old then (AddDue).
  const Vec3d moved = body.record.state.position - owed.at;
  return LateFor(body, -0.5, owed.impulse_ns, owed.angular_nms - Cross(moved, owed.impulse_ns));
}

void ImpulseExchange::Forget(BodyId id) {
  std::erase_if(owed_, [id](const OwedImpulse& owed) { return owed.id == id; });
}

ImpulseExchange::Settlement ImpulseExchange::Settle(const Inputs& in) {
  Settlement settlement;
  const auto says = [](const BorderFrame& frame) { return !frame.impulses.empty() || !frame.late_corrections.empty(); };
  if (border_.empty() && owed_.empty() && std::ranges::none_of(in.frames, says)) return settlement;
  due_.assign(in.bodies.places(), std::nullopt);
  TakeLateCorrections(in, settlement);
  const std::vector<Solution> solutions = GatherSolutions(in);
  for (auto first = solutions.begin(); first != solutions.end();) {
    const auto last = std::find_if(first, solutions.end(), [&](const Solution& s) { return Before(*first, s); });
    SettlePair(std::span(first, last), in, settlement);
    first = last;
  }
  AddOwed(in.bodies);
  settlement.pushes = PushBodies(in.bodies);
  return settlement;
}

// A late correction for a body that has gone on since is sent on after it.
void ImpulseExchange::TakeLateCorrections(const Inputs& in, Settlement& settlement) {
  for (const BorderFrame& frame : in.frames) {
    for (const LateCorrection& late : frame.late_corrections) {
      const Vec3d impulse(late.impulse_ns), angular(late.angular_nms);
      if (const DepartingBody* body = FindDeparting(in.departed, late.id); body != nullptr) {
        if (const auto onward = LateFor(*body, 1, impulse, angular)) settlement.late.push_back(*onward);
      } else if (const std::ptrdiff_t index = in.bodies.IndexOf(late.id); index >= 0) {
        AddDue(index, {impulse, angular, false}, in);
      }
    }
  }
}

// Solutions of this region and of its neighbours, ascending by pair. A link may have gone down since the contact.
std::vector<Solution> ImpulseExchange::GatherSolutions(const Inputs& in) const {
  std::vector<Solution> solutions;
  solutions.reserve(3 * border_.size());
  for (const BorderContact& contact : border_) {
    const bool up = std::binary_search(in.links_up.begin(), in.links_up.end(), contact.solution.other);
    if (up) solutions.push_back(contact.solution);
  }
  for (std::size_t n = 0; n < in.frames.size(); ++n) {
    const auto middle = std::ssize(solutions);
    for (const ImpulseRecord& record : in.frames[n].impulses) {
      solutions.push_back(ToSolution(record));
      solutions.back().reporter = in.neighborhood[n];
    }
    std::inplace_merge(solutions.begin(), solutions.begin() + middle, solutions.end(), Before);
  }
  return solutions;
}

// One of a pair that touched in the last step, as it is now.
ImpulseExchange::Party ImpulseExchange::PartyOf(BodyId id, const Inputs& in) const {
  Party party;
  party.id = id;
  party.place = in.bodies.PlaceOf(id);
  const std::ptrdiff_t own = std::ssize(in.bodies.owned());
  party.mass_kg =
      party.place < 0 ? catalog_.MassOf(id) : in.bodies.DefAt(static_cast<std::size_t>(party.place)).mass_kg;
  party.departed = FindDeparting(in.departed, id);
  if (party.departed != nullptr) {
    party.was_here = true;
    party.slept = party.departed->record.state.asleep;
  } else if (party.place >= 0 && party.place < own) {
    party.reported = std::binary_search(in.taken_in.begin(), in.taken_in.end(), id);
    party.was_here = !party.reported;
    party.slept = in.bodies.owned()[static_cast<std::size_t>(party.place)].state.asleep;
  } else if (party.place >= 0) {
    const Ghost& ghost = in.bodies.ghosts()[static_cast<std::size_t>(party.place - own)];
    party.reported = ghost.reported;
    party.slept = ghost.reported && ghost.record.state.asleep;
  }
  return party;
}

// `solutions` are all of one pair. A neighbour that reports a contact knows best who owned its own body.
void ImpulseExchange::SettlePair(std::span<const Solution> solutions, const Inputs& in, Settlement& settlement) {
  const Party a = PartyOf(solutions.front().a, in), b = PartyOf(solutions.front().b, in);
  const Solution *of_a = nullptr, *of_b = nullptr;
  RegionId owner_of_a, owner_of_b;
  for (const Solution& solution : solutions) {
    const bool mine = solution.reporter == RegionId();
    if (!mine && (solution.by_owner_of_a ? a : b).was_here) continue;
    (solution.by_owner_of_a ? of_a : of_b) = &solution;
    if (mine) (solution.by_owner_of_a ? owner_of_b : owner_of_a) = solution.other;
  }
  if (of_a != nullptr && of_a->reporter != RegionId()) owner_of_a = of_a->reporter;
  if (of_b != nullptr && of_b->reporter != RegionId()) owner_of_b = of_b->reporter;
  // A sleeper is not solved by its owner: there is nothing to balance.
  if (a.slept || b.slept || (a.was_here && b.was_here)) return;
  const bool between_others = !a.was_here && !b.was_here;
  if (between_others && !(a.reported && b.reported)) return;
  const PairCorrection due = CorrectionOf(of_a, of_b, a.mass_kg, b.mass_kg);
  GiveShare(a, {due.impulse_on_a, due.angular_on_a, true}, owner_of_b, between_others, in, settlement);
  GiveShare(b, {due.impulse_on_b, due.angular_on_b, true}, owner_of_a, between_others, in, settlement);
}

// A ghost gets its share as well, so that it starts the step as it does with its owner.
void ImpulseExchange::GiveShare(const Party& party, const Correction& share, RegionId other_owner, bool between_others,
                                const Inputs& in, Settlement& settlement) {
  if (party.departed != nullptr && party.departed->to != other_owner) {
    if (const auto late = LateFor(*party.departed, 1, share.impulse, share.angular)) settlement.late.push_back(*late);
  } else if (party.place >= 0 && !(between_others && party.place < std::ssize(in.bodies.owned()))) {
    AddDue(party.place, share, in);
  }
}

// The impulse that a body is due that changed hands, so many ticks before its new owner hears of it. The receiver takes
// it to be about where the body is a tick and a half before it acts (AddDue). Beyond limits it would be refused there,
// and the frame with it.
std::optional<ImpulseExchange::AddressedCorrection> ImpulseExchange::LateFor(const DepartingBody& body, double ticks,
                                                                             Vec3d impulse, Vec3d angular) const {
  const Vec3d moved = Vec3d(body.record.state.linear_velocity) * (ticks * tick_s_);
  const LateCorrection late{body.record.id, Vec3f(impulse), Vec3f(angular - Cross(moved, impulse))};
  if (!IsSaneImpulse(late.impulse_ns) || !IsSaneAngularImpulse(late.angular_nms)) return std::nullopt;
  return AddressedCorrection{body.to, late};
}

ImpulseExchange::Correction& ImpulseExchange::DueAt(std::size_t place) {
  return due_[place].has_value() ? *due_[place] : due_[place].emplace();
}

// A contact acts where bodies are at the start of its step, a force where they are half way through the next.
void ImpulseExchange::AddDue(std::ptrdiff_t place, Correction share, const Inputs& in) {
  constexpr double kLateTicks = 1.5;
  const auto at = static_cast<std::size_t>(place);
  const Vec3d moved = Vec3d(in.bodies.StateAt(at).linear_velocity) * (kLateTicks * tick_s_);
  share.angular -= Cross(moved, share.impulse);
  DueAt(at) += share;
}

void ImpulseExchange::AddOwed(const Bodies& bodies) {
  for (const OwedImpulse& owed : owed_) {
    const std::ptrdiff_t place = bodies.PlaceOf(owed.id);
    if (place < 0) continue;
    const auto at = static_cast<std::size_t>(place);
    const Vec3d moved = bodies.StateAt(at).position - owed.at;
    DueAt(at) += {owed.impulse_ns, owed.angular_nms - Cross(moved, owed.impulse_ns), false};
  }
  owed_.clear();
}

// A correction acts over the whole tick, as a force: a blow would throw what lies in a pile off its support, and a pile
// that is thrown about in every tick asks for twice the substeps. A body that still touches another's gets a tenth of
// its correction now, and of the rest in the next tick: each side answers at once to what it is given, and all of it
// would go to and fro between them. A body that has parted gets all of it, before it is elsewhere.
std::vector<ImpulseExchange::Push> ImpulseExchange::PushBodies(const Bodies& bodies) {
  constexpr double kAtOnce = 0.1, kLeast_m_s = 1e-9;
  std::vector<Push> pushes;
  for (std::size_t place = 0; place < due_.size(); ++place) {
    if (!due_[place].has_value()) continue;
    const BodyDef& def = bodies.DefAt(place);
    Correction due = *due_[place];
    BodyState state = bodies.world().StateOf(def.id);
    if (state.asleep) continue;
    const bool by_and_by = due.touches && Length(due.impulse) > kLeast_m_s * def.mass_kg;
    const OwedImpulse rest{def.id, due.impulse * (1 - kAtOnce), due.angular * (1 - kAtOnce), state.position};
    if (by_and_by) due = {due.impulse * kAtOnce, due.angular * kAtOnce, true};
    state.linear_velocity += Vec3f(due.impulse / def.mass_kg);
    state.angular_momentum += Vec3f(due.angular);
    const Vec3f force(due.impulse / tick_s_), torque(due.angular / tick_s_);
    if (!tessera::IsSane(state) || !CheckForce(def.id, force, torque).ok()) continue;
    pushes.push_back({def.id, force, torque});
    if (by_and_by) owed_.push_back(rest);
  }
  return pushes;
}

void ImpulseExchange::Validate() const {
  assert(
      Ascends(border_, [](const BorderContact& contact) { return std::pair(contact.solution.a, contact.solution.b); }));
  assert(std::ranges::all_of(
      owed_, [this](const OwedImpulse& owed) { return std::ranges::count(owed_, owed.id, &OwedImpulse::id) == 1; }));
}

}  // namespace tessera::region
