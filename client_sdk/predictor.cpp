#include "client_sdk/predictor.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <tuple>

#include "absl/strings/str_cat.h"
#include "client_sdk/blend.h"
#include "client_sdk/shape_radius.h"
#include "core/physics/body_path.h"
#include "core/region/fields.h"
#include "core/region/region_players.h"

namespace tessera::client {
namespace {

// Bodies that could be touched before the server's next state are simulated as well, the nearest of them.
constexpr double kReach_m = 0.5, kHorizon_s = 0.2;
constexpr std::size_t kMaxPredictedBodies = 48;
constexpr std::size_t kMaxUntaken = 64;  // corrections that nobody has asked for
// A body that is off by more than this was moved on purpose.
constexpr double kTeleport_m = 3;
// The physics' coarse stages count from an origin; further away it is moved.
constexpr double kMaxFromOrigin_m = 1000;
// Ground is needed so far about the own body, beyond its own radius: for what stands beside it, and for where all of
// that gets to in the ticks that are simulated.
constexpr double kGroundBeyond_m = 2, kGroundHorizon_s = 2 * kHorizon_s, kMostGround_m = 60;
// And so far, if it is no more work, while something that was thrown is shown ahead.
constexpr double kGroundOfThrown_m = 34;

// The wire rounds orientations; a character that leans by that would stand elsewhere.
void StandUpright(BodyState& state) {
  state.orientation.x = state.orientation.z = 0;
  state.orientation = Normalized(state.orientation);
  state.angular_velocity.x = state.angular_velocity.z = 0;
}

// The input of another player who keeps walking as they do: their own is not known here.
PlayerInput GoingOn(const CharacterRules& rules, const BodyState& state) {
  const Vec3d velocity(state.linear_velocity);
  const Quatd q = state.orientation;
  const double speed = std::hypot(velocity.x, velocity.z), walk = rules.walk_speed_m_s;
  PlayerInput input;
  input.yaw_rad = static_cast<float>(2 * std::atan2(q.y, q.w));
  const bool runs = speed > walk && rules.run_speed_m_s > walk;
  if (runs) input.buttons = kRunButton;
  const Vec3d local = Rotate(Conjugate(q), Vec3d(velocity.x, 0, velocity.z)) / (runs ? rules.run_speed_m_s : walk);
  input.move = {static_cast<float>(local.x), static_cast<float>(-local.z)};
  return input;
}

double Speed(const BodyState& state) { return Length(Vec3d(state.linear_velocity)); }

}  // namespace

Predictor::Predictor(const std::shared_ptr<const Scene>& scene, PlayerNumber player,
                     std::shared_ptr<const LevelIndex> index)
    : catalog_(scene),
      player_def_(catalog_.MakePlayer(player)),
      own_def_(player_def_),
      ground_(scene, std::move(index)),
      tick_s_(1.0 / catalog_.scene().tick_rate_hz) {
  for (const BodyDef& def : catalog_.scene().bodies) {
    if (def.path != nullptr) paths_.push_back(&def);
  }
}

const BodyDef* Predictor::DefOf(BodyId id) const {
  return IsPlayerBody(id) ? &player_def_ : catalog_.Find(id);  // players look alike
}

Tick Predictor::tick() const { return base_tick_.value_or(Tick()) + simulated_; }

void Predictor::Follow(BodyId own, const PlayerLimits& limits) {
  limits_ = limits;
  if (own == own_def_.id) return;
  Forget();
  own_def_ = *DefOf(own);
  own_def_.id = own;
  own_radius_m_ = 0;
}

void Predictor::Connect(const std::vector<game::JointOfBody>& joints) {
  const std::vector<JointDef> before = std::exchange(joints_, {});
  for (const auto& [body, joint] : joints) joints_.push_back(game::DefinitionOf(joint, body));
  // One that is made anew between the same bodies has another id.
  for (const JointDef& joint : before) {
    const bool stays = std::ranges::find(joints_, joint.id, &JointDef::id) != joints_.end();
    if (!stays && world_ != nullptr && world_->HasJoint(joint.id)) world_->RemoveJoint(joint.id);
  }
}

absl::Status Predictor::SetMovement(const tessera_movement* table) {
  movement_.reset();
  known_missing_.clear();
  if (table != nullptr) {
    absl::StatusOr<GameMovement> movement = MovementIn(catalog_.scene(), *table);
    if (!movement.ok()) return movement.status();
    movement_ = *std::move(movement);
  }
  Forget();  // it goes on from the next state by what it has now
  return absl::OkStatus();
}

void Predictor::TakeMovement(const replication::MovementNews& news) {
  if (news.state.body != own_def_.id || (moved_by_ && news.tick <= moved_by_->tick)) return;
  moved_by_ = news;
  if (!LacksMovement()) return;
  std::string missing = absl::StrCat("the world moves body ", news.state.body.value(), " by movement ", news.name,
                                     " version ", news.state.version, " with ", news.state.size, " bytes of state; ");
  if (!movement_) {
    missing += "this program has none";
  } else {
    absl::StrAppend(&missing, "this program has ", movement_->name, " version ", movement_->version, " with ",
                    movement_->state_bytes);
  }
  if (known_missing_ == missing) return;
  missing_ = known_missing_ = std::move(missing);
}

// Whether the own body is moved by a function of the game that is not here.
bool Predictor::LacksMovement() const {
  if (!moved_by_) return false;
  const bool same = movement_ && movement_->name == moved_by_->name && movement_->version == moved_by_->state.version &&
                    movement_->state_bytes == moved_by_->state.size && movement_->Moves(own_def_);
  return !same;
}

const GameMovement* Predictor::MovementInForce() const { return moved_by_ && !LacksMovement() ? &*movement_ : nullptr; }

// The private state right after `last_input`: as the region says, or where that was lost, as it came out here.
MovementState Predictor::MovementAt(Tick tick, std::uint32_t last_input) const {
  if (MovementInForce() == nullptr) return {};
  if (moved_by_->tick == tick) return moved_by_->state;
  const auto own = movement_after_.find(last_input);
  return own != movement_after_.end() ? own->second : moved_by_->state;
}

void Predictor::Forget() {
  DropThrown();
  base_tick_.reset();
  inputs_.clear();
  simulated_ = 0;
  bodies_.clear();
  on_paths_.clear();
  jumps_.clear();
  world_.reset();
  moved_by_.reset();
  movement_now_ = {};
  movement_after_.clear();
}

// The own body stands where nothing of the ground is known yet.
void Predictor::Pause() {
  DropThrown();
  base_tick_.reset();
  simulated_ = 0;
  for (const auto& [id, body] : bodies_) {
    if (world_ != nullptr && world_->Has(id)) world_->Remove(id);
  }
  bodies_.clear();
  jumps_.clear();
}

double Predictor::GroundReach(const BodyState& own) const {
  const double reach = RadiusOf(*own_def_.shape) + kGroundBeyond_m + kGroundHorizon_s * Speed(own);
  return std::min(reach, kMostGround_m);
}

void Predictor::Prepare(const BodyState& own, WorkBudget& budget) {
  if (world_ == nullptr) Begin(own.position);
  ground_.Work(*world_, own.position, GroundReach(own), budget, NeedsInputs() ? kGroundOfThrown_m : 0);
}

bool Predictor::HasGround(const BodyState& own) {
  if (world_ == nullptr) return false;
  if (Length(own.position - origin_) > kMaxFromOrigin_m && ground_.Covers(own.position, GroundReach(own))) {
    Begin(own.position);  // the ground near it is built anew at once: a millisecond, once a kilometre
    WorkBudget budget = WorkBudget::Unlimited();
    ground_.Work(*world_, own.position, GroundReach(own), budget);
  }
  return ground_.Covers(own.position, GroundReach(own));
}

void Predictor::Correct(Tick tick, std::uint32_t last_input, const std::map<BodyId, SeenBody>& bodies) {
  if (base_tick_.has_value() && tick <= *base_tick_) return;
  const auto own = bodies.find(own_def_.id);
  if (own == bodies.end()) return;
  if (LacksMovement() || !HasGround(own->second.state)) {
    std::erase_if(inputs_, [&](const PlayerInput& input) { return input.number <= last_input; });
    return Pause();
  }
  const bool fresh = !base_tick_.has_value();
  const std::uint32_t newest = inputs_.empty() ? 0 : inputs_[std::max<std::size_t>(simulated_, 1) - 1].number;
  std::map<BodyId, Pose> shown;
  for (const auto& [id, body] : bodies_) shown.emplace(id, Raw(body));
  std::erase_if(inputs_, [&](const PlayerInput& input) { return input.number <= last_input; });

  const std::map<BodyId, std::uint8_t> jumps = jumps_;
  Correction correction{.tick = tick, .last_input = last_input};
  if (!fresh) {
    correction.late = (tick - *base_tick_) - (std::int64_t{last_input} - std::int64_t{base_input_});
    if (own->second.region != base_region_) correction.from = base_region_;
  }
  const BodyId met = Met();
  base_tick_ = tick;
  base_input_ = last_input;
  base_region_ = own->second.region;
  movement_now_ = MovementAt(tick, last_input);
  movement_after_.clear();
  LetGo(tick);
  TakeOver(bodies, shown);
  Choose(bodies);
  Place(tick, bodies);
  Simulate();
  // The same input as before must lead to the same place; one that acts later than was thought shows here as well.
  if (fresh || newest == 0) return;
  for (auto& [id, body] : bodies_) {
    const auto before = shown.find(id);
    if (before == shown.end()) continue;
    const Pose raw = Raw(body);
    const Vec3d gap = before->second.position - raw.position;
    body.offset += gap;
    body.turn = Normalized(body.turn * (before->second.orientation * Conjugate(raw.orientation)));
    const auto counted = jumps.find(id);
    const bool jumped = counted != jumps.end() && counted->second != jumps_.at(id);
    if (jumped || Length(body.offset) > kTeleport_m) body.offset = Vec3d(), body.turn = Quatd();
    const auto taken = std::ranges::find(thrown_news_, id, &ThrownNews::body);
    if (taken != thrown_news_.end() && taken->off_m == 0) taken->off_m = Length(gap);
    if (jumped || id != own_def_.id) continue;
    last_correction_m_ = correction.off_m = Length(gap);
    if (last_correction_m_ > kNotable_m) NoteCorrection(correction, met);
  }
}

// `met`: which body the own one touched in the simulation before the correction.
void Predictor::NoteCorrection(Correction correction, BodyId met) {
  using Cause = Correction::Cause;
  ++corrections_;
  correction.met = met != BodyId() ? met : Met();
  if (correction.from != RegionId()) {
    correction.cause = Cause::kOwner;
  } else if (correction.late != 0) {
    correction.cause = Cause::kInputs;
  } else if (correction.met != BodyId()) {
    correction.cause = Cause::kMeeting;
  }
  if (untaken_.size() < kMaxUntaken) untaken_.push_back(correction);
}

// The first body that moves and that the own one touches in the simulation, itself or through others; 0: none.
BodyId Predictor::Met() const {
  for (const auto& [id, body] : bodies_) {
    if (body.touched && id != own_def_.id) return id;
  }
  return {};
}

// Assemblies are simulated along whole, since a joint without its other end is another body. What the own body could
// touch comes before what others could.
void Predictor::Choose(const std::map<BodyId, SeenBody>& bodies) {
  const std::vector<Centre> centres = Centres(bodies);
  std::vector<std::tuple<bool, double, BodyId>> near;  // by others alone, gap in m
  for (const auto& [id, seen] : bodies) {
    const BodyDef* def = DefOf(id);
    if (def == nullptr || id == own_def_.id) continue;
    const double radius = RadiusOf(*def->shape), speed = Speed(seen.state);
    for (const Centre& centre : centres) {
      const double gap = Length(seen.state.position - centre.state.position) - centre.radius_m - radius;
      if (!(gap < kReach_m + kHorizon_s * (Speed(centre.state) + speed))) continue;
      near.emplace_back(&centre != centres.data(), gap, id);
      break;
    }
  }
  std::sort(near.begin(), near.end());
  if (near.size() > kMaxPredictedBodies) near.resize(kMaxPredictedBodies);
  std::set<BodyId> chosen{own_def_.id};
  for (const auto& [by_others, gap, id] : near) {
    for (const BodyId part : catalog_.AssemblyOf(id)) {
      if (bodies.contains(part)) chosen.insert(part);
    }
  }
  for (const auto& [id, body] : bodies_) {
    if (body.thrown && (bodies.contains(id) || FindThrown(id) != nullptr)) chosen.insert(id);
  }
  for (const JointDef& joint : joints_) {
    for (const BodyId id : {joint.body_a, joint.body_b}) {
      if (bodies.contains(id) && DefOf(id) != nullptr) chosen.insert(id);
    }
  }

  for (auto body = bodies_.begin(); body != bodies_.end();) {
    if (chosen.contains(body->first)) {
      ++body;
      continue;
    }
    if (world_->Has(body->first)) world_->Remove(body->first);
    body = bodies_.erase(body);
  }
  for (const BodyId id : chosen) bodies_.try_emplace(id);
  jumps_.clear();
  for (const BodyId id : chosen) {
    if (const auto seen = bodies.find(id); seen != bodies.end()) jumps_[id] = seen->second.jumps;
  }
}

void Predictor::Begin(Vec3d near) {
  origin_ = {std::round(near.x), std::round(near.y), std::round(near.z)};
  ground_.Begin();
  world_ = std::make_unique<physics::World>(
      physics::WorldSettings{.origin = origin_, .gravity_m_s2 = catalog_.scene().gravity_m_s2});
  for (const BodyDef* def : paths_) world_->Add(*def, def->initial);
}

// A body that stands still and holds another by a joint, and is not near: something at its place that touches nothing.
void Predictor::AddAnchor(BodyId id) {
  const BodyDef* held = id == BodyId() ? nullptr : DefOf(id);
  if (held == nullptr || held->motion != Motion::kStatic || world_->Has(id)) return;
  constexpr double kAnchorRadius_m = 0.01;
  BodyDef anchor = *held;
  anchor.shape = std::make_shared<const Shape>(Shape{SphereShape{kAnchorRadius_m}});
  anchor.trigger = true;
  anchor.layer.collides = 0;
  world_->Add(anchor, anchor.initial);
}

// Bodies with paths are where they are at `tick`, and move from there.
void Predictor::FollowPaths(Tick tick) {
  for (const BodyDef* def : paths_) {
    const BodyState state = physics::StateOn(*def->path, tick, catalog_.scene().tick_rate_hz);
    world_->SetState(def->id, state);
    Body& body = on_paths_[def->id];
    body.before = body.now;
    body.now = state;
  }
}

void Predictor::Tune(const BodyDef& def, const SeenBody& seen) {
  world_->SetGravityScale(seen.id, GravityScaleOf(def, seen.tuning));
  world_->SetMaterial(seen.id, MaterialOf(def, seen.tuning));
}

void Predictor::PlaceJoints() {
  const auto add = [this](const JointDef& joint) {
    const bool complete = world_->Has(joint.body_a) && (joint.body_b == BodyId() || world_->Has(joint.body_b));
    if (complete && !world_->HasJoint(joint.id)) world_->AddJoint(joint);
  };
  for (const auto& [id, body] : bodies_) {
    catalog_.ForEachJoint(id, [&](const JointDef& joint) {
      AddAnchor(joint.body_a);
      AddAnchor(joint.body_b);
      add(joint);
    });
  }
  for (const JointDef& joint : joints_) add(joint);
}

void Predictor::Place(Tick tick, const std::map<BodyId, SeenBody>& bodies) {
  for (auto& [id, body] : bodies_) {
    if (!bodies.contains(id)) continue;  // one that was thrown
    const SeenBody& seen = bodies.at(id);
    BodyState state = seen.state;
    if (IsPlayerBody(id) && catalog_.scene().player->character.has_value()) StandUpright(state);
    // A state of another region, or an older one, is brought to the same tick along its velocity.
    if (!AtRest(state)) {
      const auto ticks = std::clamp<std::int64_t>(tick - seen.tick, -std::int64_t{kMaxTicks}, std::int64_t{kMaxTicks});
      state.position += Vec3d(state.linear_velocity) * (static_cast<double>(ticks) * tick_s_);
    }
    if (!world_->Has(id)) {
      BodyDef def = *DefOf(id);
      def.id = id;
      world_->Add(def, state);
    } else {
      world_->SetState(id, state);
    }
    Tune(*DefOf(id), seen);
    body.before = body.now = world_->StateOf(id);
  }
  FollowPaths(tick);
  for (auto& [id, body] : on_paths_) body.before = body.now;
  if (own_radius_m_ == 0) {
    const Aabb box = world_->BoundsOf(own_def_.id);
    own_radius_m_ = Length(box.max - box.min) / 2;
  }
  PlaceJoints();
  own_now_ = bodies_.at(own_def_.id).now;
  for (Thrown& thrown : thrown_) PlaceThrown(thrown);
}

void Predictor::Simulate() {
  simulated_ = 0;
  for (auto& [id, body] : bodies_) {
    body.touched = id == own_def_.id;
    body.ahead = body.touched || body.thrown;
  }
  for (auto& [id, body] : on_paths_) body.touched = body.ahead = false;
  const std::size_t ticks = std::min(inputs_.size(), kMaxTicks);
  for (std::size_t i = 0; i < ticks; ++i) Step(inputs_[i]);
}

void Predictor::Add(const PlayerInput& input) {
  inputs_.push_back(input);
  if (running() && simulated_ + 1 == inputs_.size() && simulated_ < kMaxTicks) Step(input);
}

// Another player who keeps doing as they do: their inputs are not known here, nor is the private state of a movement.
physics::CharacterDrive Predictor::DriveOfOther(BodyId id, const Body& body) const {
  if (!IsPlayerBody(id)) return {};
  const Scene& scene = catalog_.scene();
  const GameMovement* const game = MovementInForce();
  const region::MovementKind kind = region::KindOfMovement(scene, player_def_, true, game);
  if (kind == region::MovementKind::kForce) return {};
  const bool walks = kind == region::MovementKind::kCharacter;
  const PlayerInput does = walks ? GoingOn(*scene.player->character, body.now) : PlayerInput{};
  static const PlayerLimits kNone;
  return region::Move({*world_, scene, kind, id, 0, tick_s_, kNone, game}, does, {}).drive;
}

// Fields and a player's input push a body in the next step.
physics::CharacterDrive Predictor::DriveOf(BodyId id, const Body& body, const PlayerInput& input) {
  const Scene& scene = catalog_.scene();
  physics::CharacterDrive drive;
  if (id == own_def_.id) {
    const GameMovement* const game = MovementInForce();
    const region::MovementKind kind = region::KindOfMovement(scene, own_def_, IsPlayerBody(id), game);
    const region::Moved moved =
        region::Move({*world_, scene, kind, id, own_radius_m_, tick_s_, limits_, game}, input, movement_now_);
    drive = moved.drive;
    movement_now_ = moved.state;
    if (game != nullptr) movement_after_.insert_or_assign(input.number, moved.state);
  } else {
    drive = DriveOfOther(id, body);
  }
  if (!scene.fields.empty() && !body.now.asleep) {
    drive.force_n += Vec3f(region::FieldAcceleration(scene.fields, body.now) * world_->MassOf(id));
  }
  return drive;
}

void Predictor::Step(const PlayerInput& input) {
  std::map<BodyId, physics::CharacterDrive> drives;
  for (const auto& [id, body] : bodies_) {
    if (world_->Has(id)) drives.emplace(id, DriveOf(id, body, input));
  }
  for (const auto& [id, drive] : drives) world_->ApplyForce(id, drive.force_n, drive.torque_nm);
  world_->Step(tick_s_);
  FollowPaths(*base_tick_ + (simulated_ + 1));
  for (auto& [id, body] : bodies_) {
    if (!world_->Has(id)) continue;
    body.before = body.now;
    body.now = world_->StateOf(id);
  }
  own_now_ = bodies_.at(own_def_.id).now;
  ++simulated_;
  NoteTouched();
  NoteThrown(input.number);
}

void Predictor::NoteTouched() {
  Spread(&Body::touched);
  Spread(&Body::ahead);
}

// Marks the bodies that a marked one touches or holds, and those that they touch in turn.
void Predictor::Spread(bool Body::*mark) {
  for (bool more = true; more;) {
    more = false;
    for (const physics::Contact& contact : world_->contacts()) {
      for (const BodyId id : {contact.body_a, contact.body_b}) {
        if (const auto path = on_paths_.find(id); path != on_paths_.end()) path->second.*mark |= IsOwn(contact);
      }
      const auto a = bodies_.find(contact.body_a), b = bodies_.find(contact.body_b);
      if (a == bodies_.end() || b == bodies_.end() || a->second.*mark == b->second.*mark) continue;
      if (contact.depth_m < 0 && contact.impulse_on_b == Vec3f()) continue;
      a->second.*mark = b->second.*mark = more = true;
    }
    more = SpreadOverJoints(mark) || more;
  }
}

// The same for what a game's joints hold together.
bool Predictor::SpreadOverJoints(bool Body::*mark) {
  bool more = false;
  for (const JointDef& joint : joints_) {
    const auto a = bodies_.find(joint.body_a), b = bodies_.find(joint.body_b);
    if (a == bodies_.end() || b == bodies_.end() || a->second.*mark == b->second.*mark) continue;
    a->second.*mark = b->second.*mark = more = true;
  }
  return more;
}

}  // namespace tessera::client
