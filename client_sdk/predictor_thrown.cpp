// Bodies that the player throws, until the server has them: see predictor.h.
//
// Ticks and inputs are the same count here and in the region: the game makes the body in the tick in which an input has
// acted, with which the command came, and from there both are moved by one step with each input that follows.
#include <algorithm>
#include <utility>

#include "client_sdk/predictor.h"
#include "client_sdk/shape_radius.h"
#include "core/world/prefab.h"
#include "core/world/spawned_id.h"

namespace tessera::client {
namespace {

// Ids of bodies that a game made are the highest.
constexpr BodyId kFirstSpawned(std::uint64_t{1} << 63);

}  // namespace

BodyId Predictor::Throw(const SpawnAsk& ask, std::size_t prefab, SpawnClaim claim, std::uint32_t input,
                        TimePoint until) {
  const BodyId id = SpawnedBodyId({static_cast<std::uint32_t>(prefab), kMadeHere, ++throws_, 0});
  BodyDef def = catalog_.scene().prefabs[prefab].bodies.front();
  def.id = id;
  thrown_.push_back({.def = std::move(def),
                     .motion = ask.motion,
                     .from_own = ask.from_own,
                     .claim = claim,
                     .input = input,
                     .until = until,
                     .path = {}});
  Body body;
  body.before = body.now = MadeBy(thrown_.back());
  body.weight = 1;
  body.ahead = body.thrown = true;
  bodies_.emplace(id, body);
  return id;
}

BodyState Predictor::MadeBy(const Thrown& thrown) const {
  SpawnMotion motion = thrown.motion;
  if (thrown.from_own) motion.position += own_now_.position;
  return SpawnedState(thrown.def, motion);
}

const Predictor::Thrown* Predictor::FindThrown(BodyId id) const {
  const auto at = std::ranges::find_if(thrown_, [id](const Thrown& thrown) { return thrown.def.id == id; });
  return at == thrown_.end() ? nullptr : &*at;
}

bool Predictor::Awaits(const BodyTuning& tuning) const {
  return tuning.claim && std::ranges::any_of(thrown_, [&](const Thrown& one) { return one.claim == *tuning.claim; });
}

bool Predictor::NeedsInputs() const {
  return running() && std::ranges::any_of(bodies_, [](const auto& entry) { return entry.second.thrown; });
}

void Predictor::Unthrow(const Thrown& thrown) {
  const BodyId id = thrown.def.id;
  if (world_ != nullptr && world_->Has(id)) world_->Remove(id);
  bodies_.erase(id);
}

void Predictor::ExpireThrown(TimePoint now, bool paused) {
  const TimePoint before = std::exchange(polled_at_, now).value_or(now);
  std::erase_if(thrown_, [&](Thrown& thrown) {
    if (paused) thrown.until += now - before;
    if (now < thrown.until) return false;
    Unthrow(thrown);
    thrown_news_.push_back({.thrown = thrown.def.id, .why = "the game has not made it, or not in time"});
    return true;
  });
}

void Predictor::DropThrown() {
  for (const Thrown& thrown : std::exchange(thrown_, {})) {
    Unthrow(thrown);
    thrown_news_.push_back({.thrown = thrown.def.id, .why = "nothing is predicted any more"});
  }
}

// Whatever they touch, and whether or not anybody looks: each that is shown ahead costs steps and inputs.
void Predictor::LetGo(Tick tick) {
  std::size_t going = 0;
  for (auto& [id, body] : bodies_) {
    if (body.taken == Tick()) continue;
    const bool gone = static_cast<double>(tick - body.taken) * tick_s_ >= kLetGo_s || ++going > kMaxLetGo;
    if (gone) body.thrown = false, body.taken = Tick();
  }
}

// The server's bodies take the places of those that were shown for them, wherever these are now.
void Predictor::TakeOver(const std::map<BodyId, SeenBody>& bodies, std::map<BodyId, Pose>& shown) {
  if (thrown_.empty()) return;
  for (auto seen = bodies.lower_bound(kFirstSpawned); seen != bodies.end(); ++seen) {
    if (!seen->second.tuning.claim) continue;
    const auto thrown = std::ranges::find(thrown_, *seen->second.tuning.claim, &Thrown::claim);
    if (thrown == thrown_.end()) continue;
    const BodyId id = thrown->def.id;
    Body body = bodies_.at(id);
    body.taken = *base_tick_;
    shown.insert_or_assign(seen->first, shown.at(id));
    Unthrow(*thrown);
    bodies_.insert_or_assign(seen->first, body);
    thrown_news_.push_back({.thrown = id, .body = seen->first});
    thrown_.erase(thrown);
  }
}

// The server has not sent it: it is where it was simulated. When it is made follows from the input; from then on ticks
// count, since the server moves it by one step a tick, be there an input or not.
void Predictor::PlaceThrown(Thrown& thrown) {
  const BodyId id = thrown.def.id;
  Body& body = bodies_.at(id);
  if (thrown.input > base_input_) {
    if (world_->Has(id)) world_->Remove(id);
    thrown.path.clear();
    return;
  }
  const auto is_later = [&](const Thrown::At& at) {
    return thrown.made ? at.tick > *base_tick_ : at.input > base_input_;
  };
  const auto later = std::ranges::find_if(thrown.path, is_later);
  const BodyState state = later == thrown.path.begin() ? MadeBy(thrown) : std::prev(later)->state;
  thrown.path.assign(1, {*base_tick_, base_input_, state});
  thrown.made = true;
  if (world_->Has(id)) {
    world_->SetState(id, state);
  } else {
    world_->Add(thrown.def, state);
  }
  body.before = body.now = state;
}

// After the step that `input` has made.
void Predictor::NoteThrown(std::uint32_t input) {
  for (Thrown& thrown : thrown_) {
    const BodyId id = thrown.def.id;
    Body& body = bodies_.at(id);
    if (!world_->Has(id)) {
      if (input < thrown.input) continue;
      body.before = body.now = MadeBy(thrown);
      world_->Add(thrown.def, body.now);
    }
    thrown.path.push_back({tick(), input, body.now});
  }
}

// Where bodies are simulated about: the own one, and those that were thrown.
std::vector<Predictor::Centre> Predictor::Centres(const std::map<BodyId, SeenBody>& bodies) const {
  std::vector<Centre> centres{{bodies.at(own_def_.id).state, RadiusOf(*own_def_.shape)}};
  for (const auto& [id, body] : bodies_) {
    if (!body.thrown) continue;
    const auto seen = bodies.find(id);
    const Thrown* const thrown = FindThrown(id);
    const BodyDef* const def = thrown != nullptr ? &thrown->def : DefOf(id);
    if (def == nullptr) continue;
    centres.push_back({seen == bodies.end() ? body.now : seen->second.state, RadiusOf(*def->shape)});
  }
  return centres;
}

}  // namespace tessera::client
