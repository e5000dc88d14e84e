#include "game_sdk/testing/script_world.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "game_sdk/lua/spelling.h"

namespace tessera::game {
namespace {

Vec3f ToFloats(const double* axes) {
  return {static_cast<float>(axes[0]), static_cast<float>(axes[1]), static_cast<float>(axes[2])};
}

std::string NotFound(std::string_view what, std::string_view name, const Suggestion& suggestion) {
  const std::string_view best = suggestion.best();
  return absl::StrCat("the scene has no ", absl::string_view(what.data(), what.size()), " \"",
                      absl::string_view(name.data(), name.size()), "\"",
                      best.empty() ? std::string() : absl::StrCat("; did you mean \"", std::string(best), "\"?"));
}

}  // namespace

bool ScriptWorld::Refuse(std::string why) {
  error_ = std::move(why);
  return false;
}

bool ScriptWorld::Note(const absl::Status& status) { return status.ok() || Refuse(std::string(status.message())); }

bool ScriptWorld::Step() {
  work_ = 0;
  if (!Note(world_->Step())) return false;
  hashes_.push_back(world_->Hash());
  ticks_.push_back(world_->tick().value());
  std::string first;
  for (const GameLine& line : world_->TakeLines()) {
    if (!line.error) {
      lines_.push_back(line.text);
      continue;
    }
    errors_.push_back(line.text);
    if (!first.empty()) continue;
    first =
        absl::StrCat("tick ", line.tick.value(), ", ",
                     line.self == BodyId() ? "the world" : absl::StrCat("body ", line.self.value()), ": ", line.text);
  }
  return first.empty() || errors_allowed_ || Refuse(std::move(first));
}

bool ScriptWorld::Kill(BodyId body) {
  const RegionId owner = world_->OwnerOf(body);
  if (owner == RegionId()) return Refuse(absl::StrCat("kill_region_of: no region owns body ", body.value()));
  return Note(world_->Kill(owner));
}

bool ScriptWorld::Place(BodyId body, const Placing& placing) {
  return Note(world_->Place(body, [&](BodyState& state) {
    if (placing.position != nullptr) state.position = {placing.position[0], placing.position[1], placing.position[2]};
    if (placing.rotation != nullptr) {
      state.orientation = {placing.rotation[0], placing.rotation[1], placing.rotation[2], placing.rotation[3]};
    }
    if (placing.velocity != nullptr) state.linear_velocity = ToFloats(placing.velocity);
    if (placing.spin != nullptr) state.angular_velocity = ToFloats(placing.spin);
  }));
}

bool ScriptWorld::Command(BodyId body, std::string_view bytes) {
  if (!IsPlayerBody(body)) return Refuse(absl::StrCat("command: body ", body.value(), " is no player's"));
  return Note(world_->Command(PlayerOf(body), std::string(bytes)));
}

bool ScriptWorld::TakeEvents(BodyId body) {
  if (!IsPlayerBody(body)) return Refuse(absl::StrCat("events: body ", body.value(), " is no player's"));
  events_ = world_->TakeEvents(PlayerOf(body));
  return true;
}

const std::string* ScriptWorld::EndedBecause(BodyId body) const {
  return IsPlayerBody(body) ? world_->EndedBecause(PlayerOf(body)) : nullptr;
}

bool ScriptWorld::Join(std::string_view name, BodyId& body) {
  const absl::StatusOr<PlayerNumber> player = world_->Join(std::string(name));
  if (!player.ok()) return Note(player.status());
  body = PlayerBodyId(*player);
  return true;
}

bool ScriptWorld::Leave(BodyId body) {
  if (!IsPlayerBody(body)) return Refuse(absl::StrCat("leave: body ", body.value(), " is no player's"));
  world_->Leave(PlayerOf(body));
  return true;
}

bool ScriptWorld::Input(BodyId body, const double* force_n, const double* torque_nm) {
  if (!IsPlayerBody(body)) return Refuse(absl::StrCat("input: body ", body.value(), " is no player's"));
  PlayerInput input;
  input.force_n = ToFloats(force_n);
  if (torque_nm != nullptr) input.torque_nm = ToFloats(torque_nm);
  return Note(world_->Input(PlayerOf(body), input));
}

bool ScriptWorld::Steer(BodyId body, const PlayerInput& steering) {
  if (!IsPlayerBody(body)) return Refuse(absl::StrCat("steer: body ", body.value(), " is no player's"));
  return Note(world_->Input(PlayerOf(body), steering));
}

bool ScriptWorld::FindBody(BodyId body) {
  const auto& bodies = world_->scene().bodies;
  const bool of_scene = std::ranges::find(bodies, body, &BodyDef::id) != bodies.end();
  if (of_scene || world_->OwnerOf(body) != RegionId()) return true;
  return Refuse(absl::StrCat("body: there is no body ", body.value()));
}

bool ScriptWorld::FindBody(std::string_view name, BodyId& body) {
  const auto& bodies = world_->scene().bodies;
  const auto found = std::ranges::find(bodies, name, &BodyDef::name);
  if (found == bodies.end()) {
    Suggestion suggestion(name);
    for (const BodyDef& def : bodies) suggestion.Offer(def.name);
    return Refuse(NotFound("body", name, suggestion));
  }
  body = found->id;
  return true;
}

bool ScriptWorld::ListBodies(const std::string_view* kind) {
  const std::vector<std::string>& kinds = world_->scene().kinds;
  std::uint16_t wanted = 0;
  if (kind != nullptr) {
    const auto found = std::ranges::find(kinds, *kind);
    if (found == kinds.end() || kind->empty()) {
      Suggestion suggestion(*kind);
      for (const std::string& known : kinds) suggestion.Offer(known);
      return Refuse(NotFound("kind", *kind, suggestion));
    }
    wanted = static_cast<std::uint16_t>(found - kinds.begin());
  }
  bodies_.clear();
  const auto add = [&](const BodyDef& def) {
    if (kind == nullptr || def.kind == wanted) bodies_.push_back(def.id);
  };
  for (const BodyDef& def : world_->scene().bodies) {
    if (def.motion == Motion::kStatic) add(def);
  }
  world_->ForEachBody([&](const region::OwnedBody& body) { add(*body.def); });
  std::ranges::sort(bodies_);
  return true;
}

// --- The host

int ScriptWorld::CallFromScript(tessera_game_call* call, std::uint32_t function, const tessera_game_value* arguments,
                                std::uint32_t count, tessera_game_value* result) {
  ScriptWorld& script = Of(call);
  if (function == kWorldLog) {
    script.output_.emplace_back(arguments[0].as.text, arguments[0].count);
    *result = {};
    return 0;
  }
  if (!script.world_->Call(function, {arguments, count}, script.result_, script.error_)) return 1;
  *result = script.result_.Expose();
  return 0;
}

const char* ScriptWorld::ErrorOf(const tessera_game_call* call) {
  return Of(const_cast<tessera_game_call*>(call)).error_.c_str();
}

int ScriptWorld::Charge(tessera_game_call* call, std::uint64_t instructions) {
  ScriptWorld& script = Of(call);
  script.work_ += instructions;
  return script.work_ <= kMaxScriptWork ? 0 : 1;
}

const tessera_game_host& ScriptWorld::Host() {
  static constexpr tessera_game_host kHost = {sizeof kHost, CallFromScript, ErrorOf, Charge};
  return kHost;
}

}  // namespace tessera::game
