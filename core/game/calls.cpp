#include "core/game/calls.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "core/game/blast_calls.h"
#include "core/game/clock_calls.h"
#include "core/game/control_calls.h"
#include "core/game/joint_calls.h"
#include "core/game/message_calls.h"
#include "core/game/motion_calls.h"
#include "core/game/player_calls.h"
#include "core/game/query_calls.h"
#include "core/game/record_calls.h"
#include "core/world/limits.h"
#include "core/world/prefab.h"
#include "core/world/state_check.h"
#include "game_sdk/api/api.h"

namespace tessera::game {
namespace {

using Arguments = std::span<const tessera_game_value>;

absl::string_view View(std::string_view text) { return {text.data(), text.size()}; }

// --- Arguments

absl::Status Fault(std::string_view function, std::string_view what) {
  return absl::InvalidArgumentError(absl::StrCat(View(function), ": ", View(what)));
}

bool IsFinite(const tessera_game_value& value) {
  const auto finite = [&](std::span<const double> parts) {
    return std::ranges::all_of(parts, [](double part) { return std::isfinite(part); });
  };
  switch (value.type) {
    case TESSERA_GAME_REAL:
      return std::isfinite(value.as.real);
    case TESSERA_GAME_VECTOR:
      return finite(value.as.vector);
    case TESSERA_GAME_ROTATION:
      return finite(value.as.rotation);
    default:
      return true;
  }
}

std::string Named(Types types) {
  std::vector<absl::string_view> names;
  for (unsigned type = 0; type <= TESSERA_GAME_FIELDS; ++type) {
    if ((types >> type & 1) != 0) names.push_back(View(TypeName(static_cast<tessera_game_type>(type))));
  }
  return absl::StrJoin(names, " or ");
}

absl::Status CheckOne(const Function& function, const Parameter& parameter, const tessera_game_value& value) {
  const bool known = value.type <= TESSERA_GAME_FIELDS;
  const Types given = known ? Types{1} << value.type : Types{0};
  const bool widened = given == kWholeType && (parameter.types & kRealType) != 0;
  if ((given & parameter.types) == 0 && !widened) {
    return Fault(function.name, absl::StrCat("`", View(parameter.name), "` must be ", Named(parameter.types), ", got ",
                                             View(TypeName(static_cast<tessera_game_type>(value.type)))));
  }
  if (!IsFinite(value)) return Fault(function.name, absl::StrCat("`", View(parameter.name), "` is not finite"));
  return absl::OkStatus();
}

// The arguments after the receiver, by the table.
absl::Status Check(const Function& function, Arguments arguments) {
  if (function.parameters.empty() && arguments.empty()) return absl::OkStatus();
  const std::size_t most = function.parameters.size();
  const auto least = static_cast<std::size_t>(
      std::ranges::count_if(function.parameters, [](const Parameter& parameter) { return !parameter.optional; }));
  if (arguments.size() > most) {
    return Fault(function.name, absl::StrCat("takes ", most, " arguments, got ", arguments.size()));
  }
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    const Parameter& parameter = function.parameters[i];
    if (parameter.optional && arguments[i].type == TESSERA_GAME_NOTHING) continue;
    if (absl::Status status = CheckOne(function, parameter, arguments[i]); !status.ok()) return status;
  }
  if (arguments.size() < least) {
    return Fault(function.name, absl::StrCat("`", View(function.parameters[arguments.size()].name), "` is missing"));
  }
  return absl::OkStatus();
}

std::string_view TextOf(const tessera_game_value& value) { return {value.as.text, value.count}; }
Vec3d VectorOf(const tessera_game_value& value) { return {value.as.vector[0], value.as.vector[1], value.as.vector[2]}; }
bool Given(Arguments arguments, std::size_t index) {
  return arguments.size() > index && arguments[index].type != TESSERA_GAME_NOTHING;
}

// The table of options that a function takes: each is taken by its name, and what is left over has none.
class Options {
 public:
  Options(std::string_view function, Arguments arguments, std::size_t index) : function_(function) {
    if (Given(arguments, index)) fields_ = {arguments[index].as.fields, arguments[index].count};
  }

  // The option of this name, if it is given and of one of these types; status() says otherwise.
  const tessera_game_value* Take(std::string_view name, Types types) {
    names_.push_back(View(name));
    const auto field = std::ranges::find_if(
        fields_, [&](const tessera_game_field& one) { return std::string_view(one.name, one.name_bytes) == name; });
    if (field == fields_.end()) return nullptr;
    ++taken_;
    const Function asked{0, Receiver::kWorld, function_, {}, 0, {}};
    const std::string full = absl::StrCat("options.", View(name));
    const absl::Status status = CheckOne(asked, {full, types, {}}, field->value);
    if (status_.ok()) status_ = status;
    return status.ok() ? &field->value : nullptr;
  }
  // Once all have been taken.
  absl::Status status() const {
    if (!status_.ok() || taken_ == fields_.size()) return status_;
    for (const tessera_game_field& field : fields_) {
      const absl::string_view name(field.name, std::min<std::size_t>(field.name_bytes, 63));
      if (std::ranges::find(names_, name) != names_.end()) continue;
      return Fault(function_, absl::StrCat("`options.", name, "` is none of ", absl::StrJoin(names_, ", ")));
    }
    return status_;
  }

 private:
  const std::string_view function_;
  std::span<const tessera_game_field> fields_;
  std::vector<absl::string_view> names_;
  std::size_t taken_ = 0;
  absl::Status status_;
};

// --- Results

tessera_game_value OfText(std::string_view text) {
  tessera_game_value result{};
  result.type = TESSERA_GAME_TEXT;
  result.count = static_cast<std::uint32_t>(text.size());
  result.as.text = text.data();
  return result;
}

tessera_game_value Of(Quatd q) {
  tessera_game_value result{};
  result.type = TESSERA_GAME_ROTATION;
  result.as.rotation[0] = q.x, result.as.rotation[1] = q.y, result.as.rotation[2] = q.z, result.as.rotation[3] = q.w;
  return result;
}

tessera_game_value Of(GameValue value) { return ToInterface(value); }

// The quick ones: without a GameValue in between.
tessera_game_value OfFlag(bool flag) {
  tessera_game_value result;
  result.type = TESSERA_GAME_FLAG, result.count = 0, result.as.whole = flag ? 1 : 0;
  return result;
}

tessera_game_value OfReal(double real) {
  tessera_game_value result;
  result.type = TESSERA_GAME_REAL, result.count = 0, result.as.real = real;
  return result;
}

tessera_game_value OfVector(Vec3d v) {
  tessera_game_value result;
  result.type = TESSERA_GAME_VECTOR, result.count = 0;
  result.as.vector[0] = v.x, result.as.vector[1] = v.y, result.as.vector[2] = v.z;
  return result;
}

// --- The world

std::uint64_t Mixed(std::uint64_t x) {  // the finaliser of SplitMix64 (Steele, Lea, Flood 2014)
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

// As a log may hold it: a game's text ends no line and sends no escapes.
std::string OneLine(std::string_view text) {
  std::string line(text.substr(0, kMaxLogLineBytes));
  for (char& c : line) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = ' ';
  }
  return line;
}

// A callback of the world is called in each region, which shall not all do the same.
double Random(tessera_game_call& call) {
  const bool of_world = call.self == BodyId();
  const std::uint64_t about = of_world ? call.transaction.world().region().value() : call.self.value();
  const std::uint64_t seed = of_world ? Mixed(~call.seed) : Mixed(call.seed);
  const std::uint64_t bits = Mixed(Mixed(Mixed(seed ^ about) ^ call.tick.value()) ^ call.randoms++);
  return static_cast<double>(bits >> 11) * 0x1p-53;
}

absl::Status Outside(std::string_view function, Vec3d place) {
  return Fault(function, absl::StrCat("(", place.x, ", ", place.y, ", ", place.z, ") is outside the scene's bounds"));
}

// Where and how fast, and when it expires; 0: never.
struct SpawnOrder {
  SpawnMotion motion;
  Tick expires;
};

absl::StatusOr<SpawnOrder> SpawnOrderFrom(const tessera_game_call& call, Arguments arguments) {
  SpawnOrder order;
  Options options("spawn", arguments, 2);
  order.motion.position = VectorOf(arguments[1]);
  if (!call.transaction.world().scene().bounds.Contains(order.motion.position)) {
    return Outside("spawn", order.motion.position);
  }
  if (const auto* rotation = options.Take("rotation", kRotationType)) {
    const double* q = rotation->as.rotation;
    const Quatd given{q[0], q[1], q[2], q[3]};
    if (std::abs(Length(given) - 1) > kUnitTolerance) return Fault("spawn", "`options.rotation` is not of length 1");
    order.motion.rotation = Normalized(given);
  }
  if (const auto* velocity = options.Take("velocity", kVectorType)) {
    order.motion.velocity_m_s = VectorOf(*velocity);
    if (Length(order.motion.velocity_m_s) > kMaxGameSpeed_m_s) {
      return Fault("spawn", absl::StrCat("`options.velocity` is above ", kMaxGameSpeed_m_s, " m/s"));
    }
  }
  if (const auto* spin = options.Take("spin", kVectorType)) {
    order.motion.spin_rad_s = VectorOf(*spin);
    if (Length(order.motion.spin_rad_s) > kMaxAngularSpeed_rad_s) {
      return Fault("spawn", absl::StrCat("`options.spin` is above ", kMaxAngularSpeed_rad_s, " rad/s"));
    }
  }
  if (const auto* ticks = options.Take("expire_after", kWholeType)) {
    const auto expires = TicksAhead("spawn", "options.expire_after", call.tick, ticks->as.whole);
    if (!expires.ok()) return expires.status();
    order.expires = *expires;
  }
  if (absl::Status status = options.status(); !status.ok()) return status;
  return order;
}

std::string PrefabNames(const Scene& scene) {
  return scene.prefabs.empty() ? "none"
                               : absl::StrJoin(scene.prefabs, ", ", [](std::string* out, const Prefab& prefab) {
                                   out->append(prefab.name);
                                 });
}

absl::StatusOr<tessera_game_value> Spawn(tessera_game_call& call, Arguments arguments) {
  const Scene& scene = call.transaction.world().scene();
  const std::string_view name = TextOf(arguments[0]);
  const auto prefab = std::ranges::find(scene.prefabs, name, &Prefab::name);
  if (prefab == scene.prefabs.end()) {
    return absl::NotFoundError(
        absl::StrCat("spawn: no prefab \"", View(name.substr(0, 63)), "\"; the scene has: ", PrefabNames(scene)));
  }
  const absl::StatusOr<SpawnOrder> order = SpawnOrderFrom(call, arguments);
  if (!order.ok()) return order.status();
  const auto place = static_cast<std::size_t>(prefab - scene.prefabs.begin());
  const absl::StatusOr<BodyId> first = call.transaction.Spawn(place, order->motion);
  if (!first.ok()) return absl::Status(first.status().code(), absl::StrCat("spawn: ", first.status().message()));
  for (std::size_t member = 0; member < prefab->bodies.size(); ++member) {
    call.transaction.Own(WithMember(*first, member))->record.expires = order->expires;
  }
  return Of(GameValue(*first));
}

absl::StatusOr<tessera_game_value> CallWorld(tessera_game_call& call, const Function& function, Arguments arguments) {
  switch (function.number) {
    case kWorldSpawn:
      return Spawn(call, arguments);
    case kWorldTick:
      return Of(GameValue(static_cast<std::int64_t>(call.tick.value())));
    case kWorldTickRate:
      return Of(GameValue(static_cast<double>(call.transaction.world().scene().tick_rate_hz)));
    case kWorldRandom:
      return Of(GameValue(Random(call)));
    case kWorldLog:
      call.transaction.Log(OneLine(TextOf(arguments[0])));
      break;
    case kWorldAskRay:
    case kWorldAskSweep:
    case kWorldAskOverlap:
    case kWorldRay:
    case kWorldRayAll:
    case kWorldSweep:
    case kWorldOverlap:
      return CallQuery(call, function, arguments);
    case kWorldExplode:
      return CallExplode(call, function, arguments);
    case kWorldTime:
    case kWorldCount:
      return CallClock(call, function, arguments);
    case kWorldGet:
    case kWorldSet:
    case kWorldAfter:
    case kWorldCancel:
    case kWorldSend:
    case kWorldIsOwn:
    case kWorldPublish:
      return CallInstance(call, function, arguments);
    case kWorldPlayers:
    case kWorldBroadcast:
      return CallPlayers(call, function, arguments);
    default:
      return absl::InternalError(absl::StrCat(View(function.name), ": is not there yet"));
  }
  return tessera_game_value{};
}

// --- Bodies

absl::Status Push(std::string_view function, const BodyDef& def, const BodyState& state, double tick_rate_hz,
                  GameRecord& record, Vec3d impulse_ns, const Vec3d* point) {
  const double mass_kg = def.mass_kg;
  if (Length(impulse_ns) > mass_kg * kMaxGameSpeed_m_s) {
    return Fault(function,
                 absl::StrCat("makes a body of ", mass_kg, " kg faster by more than ", kMaxGameSpeed_m_s, " m/s"));
  }
  const Vec3f push_ns = record.push_ns + Vec3f(impulse_ns);
  const Vec3f push_nms =
      point == nullptr ? record.push_nms : record.push_nms + Vec3f(Cross(*point - state.position, impulse_ns));
  // It acts as a force over one tick.
  const auto rate = static_cast<float>(tick_rate_hz);
  if (!CheckForce(def.id, push_ns * rate, push_nms * rate).ok())
    return Fault(function, "turns the body more than can be computed");
  record.push_ns = push_ns;
  record.push_nms = push_nms;
  return absl::OkStatus();
}

absl::Status NotOwned(const Function& function, BodyId id) {
  return absl::FailedPreconditionError(
      absl::StrCat(View(function.name), ": body ", id.value(), " is not owned by this region"));
}

absl::StatusOr<tessera_game_value> Read(tessera_game_call& call, const Function& function, BodyId id,
                                        const BodyDef& def, Arguments arguments) {
  const Transaction& world = call.transaction;
  const Scene& scene = world.world().scene();
  switch (function.number) {
    case kBodyMember: {
      const std::int64_t number = arguments[0].as.whole;
      const std::size_t members = IsSpawned(id) ? scene.prefabs[PartsOf(id).prefab].bodies.size() : 0;
      if (number < 1 || static_cast<std::uint64_t>(number) > members) return tessera_game_value{};
      return Of(GameValue(WithMember(id, static_cast<std::size_t>(number) - 1)));
    }
    case kBodyController:
      return ControllerOf(call, function, id);
    case kBodyGet: {
      return GetProperty(call, scene.properties, def.properties, world.PropertiesOf(id), TextOf(arguments[0]));
    }
    default:
      return absl::InternalError(absl::StrCat(View(function.name), ": is not there yet"));
  }
}

// Functions of a body without arguments that cannot fail where the body is here: those that games call most. False, and
// no result, for all others.
bool ReadAtOnce(const tessera_game_call& call, std::uint32_t function, BodyId id, tessera_game_value& result) {
  const Transaction& world = call.transaction;
  const BodyDef* def = world.Find(id);
  if (function == kBodyIsHere) {
    result = OfFlag(def != nullptr);
    return true;
  }
  if (function == kBodyIsOwn) {
    result = OfFlag(world.Owns(id));
    return true;
  }
  if (def == nullptr) return false;
  switch (function) {
    case kBodyKind:
      result = OfText(world.world().scene().kinds[def->kind]);
      return true;
    case kBodyPosition:
      result = OfVector(world.StateOf(id).position);
      return true;
    case kBodyRotation:
      result = Of(Quatd(world.StateOf(id).orientation));
      return true;
    case kBodyVelocity:
      result = OfVector(Vec3d(world.StateOf(id).linear_velocity));
      return true;
    case kBodySpin:
      result = OfVector(Vec3d(world.StateOf(id).angular_velocity));
      return true;
    case kBodyMass:
      result = OfReal(def->mass_kg);
      return true;
    case kBodyPlayer:
      result = IsPlayerBody(id) ? Of(GameValue(PlayerOf(id))) : tessera_game_value{};
      return true;
    default:
      return false;
  }
}

// Removes a body, now or later.
absl::StatusOr<tessera_game_value> Leave(tessera_game_call& call, const Function& function, BodyId id,
                                         const BodyDef& def, Transaction::Changes& body, Arguments arguments) {
  const char* const why_not = def.motion != Motion::kDynamic ? " does not move, and stays"
                              : IsPlayerBody(id)             ? " is a player's, and stays with the player"
                                                             : nullptr;
  if (why_not != nullptr) return Fault(function.name, absl::StrCat("body ", id.value(), why_not));
  if (function.number == kBodyRemove) {
    call.transaction.Remove(id);
  } else if (arguments[0].as.whole == 0) {
    body.record.expires = Tick();
  } else {
    const auto expires = TicksAhead("expire_after", "ticks", call.tick, arguments[0].as.whole);
    if (!expires.ok()) return expires.status();
    body.record.expires = *expires;
  }
  return tessera_game_value{};
}

absl::StatusOr<tessera_game_value> Change(tessera_game_call& call, const Function& function, BodyId id,
                                          const BodyDef& def, Transaction::Changes& body, Arguments arguments) {
  const Transaction& world = call.transaction;
  const Scene& scene = world.world().scene();
  const bool moves = def.motion == Motion::kDynamic && !def.kinematic;
  if (IsMotionCall(function.number)) return CallMotion(call, function, id, def, body, arguments);
  switch (function.number) {
    case kBodySet: {
      const absl::Status status = SetProperty(scene.properties, TextOf(arguments[0]), arguments[1], body.properties);
      if (!status.ok()) return status;
      return tessera_game_value{};
    }
    case kBodyImpulse: {
      if (!moves) return Fault("impulse", absl::StrCat("body ", id.value(), " does not move"));
      const Vec3d point = Given(arguments, 1) ? VectorOf(arguments[1]) : Vec3d();
      const absl::Status status = Push("impulse", def, world.StateOf(id), scene.tick_rate_hz, body.record,
                                       VectorOf(arguments[0]), Given(arguments, 1) ? &point : nullptr);
      if (!status.ok()) return status;
      return tessera_game_value{};
    }
    case kBodySetVelocity: {
      if (!moves) return Fault("set_velocity", absl::StrCat("body ", id.value(), " does not move"));
      const Vec3d velocity = VectorOf(arguments[0]);
      if (Length(velocity) > kMaxGameSpeed_m_s) {
        return Fault("set_velocity", absl::StrCat("`velocity` is above ", kMaxGameSpeed_m_s, " m/s"));
      }
      const BodyState state = world.StateOf(id);
      GameRecord pushed = body.record;
      pushed.push_ns = {};
      const absl::Status status = Push("set_velocity", def, state, scene.tick_rate_hz, pushed,
                                       (velocity - Vec3d(state.linear_velocity)) * def.mass_kg, nullptr);
      if (!status.ok()) return status;
      body.record.push_ns = pushed.push_ns;
      if (body.record.teleport) body.record.teleport->velocity_m_s = Vec3f(velocity);
      if (body.record.teleport) body.record.push_ns = {};
      return tessera_game_value{};
    }
    case kBodyAfter: {
      const absl::StatusOr<std::int64_t> timer = SetTimer(call.tick, arguments, body.record);
      if (!timer.ok()) return timer.status();
      return Of(GameValue(*timer));
    }
    case kBodyShowTo: {
      const absl::Status status = ShowTo(scene, def, TextOf(arguments[0]), body.record);
      if (!status.ok()) return status;
      return tessera_game_value{};
    }
    case kBodyCancel:
      return Of(GameValue(CancelTimer(body.record, arguments[0].as.whole)));
    case kBodyRemove:
    case kBodyExpireAfter:
      return Leave(call, function, id, def, body, arguments);
    default:
      return absl::InternalError(absl::StrCat(View(function.name), ": is not there yet"));
  }
}

bool Changes(std::uint32_t function) {
  return function == kBodySet || function == kBodyImpulse || function == kBodySetVelocity || function == kBodyAfter ||
         function == kBodyCancel || function == kBodyRemove || function == kBodyExpireAfter ||
         function == kBodyShowTo || IsMotionCall(function);
}

absl::StatusOr<tessera_game_value> CallBody(tessera_game_call& call, const Function& function, BodyId id,
                                            Arguments arguments) {
  const BodyDef* def = call.transaction.Find(id);
  if (IsJointCall(function.number)) return CallJoint(call, function, id, arguments);
  if (function.number == kBodySend) return CallSend(call, function, id, arguments);
  const bool foreign = !call.transaction.Owns(id) && !call.transaction.Removed(id) &&
                       (def == nullptr || def->motion == Motion::kDynamic);
  if (foreign && IsVerb(function.number)) {
    return SendVerb(call, function, id, arguments);
  }
  if (def == nullptr)
    return absl::NotFoundError(absl::StrCat(View(function.name), ": body ", id.value(), " is not here"));
  if (!Changes(function.number)) return Read(call, function, id, *def, arguments);
  Transaction::Changes* body = call.transaction.Own(id);
  if (body == nullptr) {
    return NotOwned(function, id);
  }
  return Change(call, function, id, *def, *body, arguments);
}

absl::StatusOr<tessera_game_value> CallFunction(tessera_game_call& call, std::uint32_t number, Arguments arguments) {
  const Function* function = FindFunction(number);
  if (function == nullptr) return absl::NotFoundError(absl::StrCat("there is no function ", number));
  if (function->receiver == Receiver::kWorld) {
    if (absl::Status status = Check(*function, arguments); !status.ok()) return status;
    return CallWorld(call, *function, arguments);
  }
  if (function->receiver == Receiver::kPlayer) {
    if (arguments.empty() || arguments[0].type != TESSERA_GAME_PLAYER) {
      return Fault(function->name, "is called for a player");
    }
    if (absl::Status status = Check(*function, arguments.subspan(1)); !status.ok()) return status;
    if (arguments[0].as.id == 0 || arguments[0].as.id > UINT32_MAX) {
      return absl::NotFoundError(absl::StrCat(View(function->name), ": there is no player ", arguments[0].as.id));
    }
    return CallPlayer(call, *function, PlayerNumber(static_cast<std::uint32_t>(arguments[0].as.id)),
                      arguments.subspan(1));
  }
  if (arguments.empty() || arguments[0].type != TESSERA_GAME_BODY) return Fault(function->name, "is called for a body");
  if (absl::Status status = Check(*function, arguments.subspan(1)); !status.ok()) return status;
  return CallBody(call, *function, BodyId(arguments[0].as.id), arguments.subspan(1));
}

// --- The interface

[[gnu::noinline]] int CallAny(tessera_game_call* call, std::uint32_t function, Arguments arguments,
                              tessera_game_value* result) {
  const auto returned = CallFunction(*call, function, arguments);
  if (!returned.ok()) {
    call->error = std::string(returned.status().message());
    return 1;
  }
  *result = *returned;
  return 0;
}

int Call(tessera_game_call* call, std::uint32_t function, const tessera_game_value* arguments, std::uint32_t count,
         tessera_game_value* result) {
  tessera_game_value unwanted;
  if (result == nullptr) result = &unwanted;
  if (count == 1 && arguments[0].type == TESSERA_GAME_BODY &&
      ReadAtOnce(*call, function, BodyId(arguments[0].as.id), *result)) {
    return 0;
  }
  return CallAny(call, function, {arguments, count}, result);
}

const char* Error(const tessera_game_call* call) { return call->error.c_str(); }

int Charge(tessera_game_call* call, std::uint64_t instructions) {
  call->instructions += std::min(instructions, std::numeric_limits<std::uint64_t>::max() - call->instructions);
  return call->instructions <= call->budget ? 0 : 1;
}

constexpr tessera_game_host kHost{sizeof(tessera_game_host), Call, Error, Charge};

}  // namespace

const tessera_game_host& GameFunctions() { return kHost; }

absl::Status CarryOut(tessera_game_call& call, BodyId target, const Message& message) {
  if (message.verb == kPlayerControl) return CarryOutControl(call, target, message);
  if (message.verb == kBodyConnect) return CarryOutConnect(call, target, message);
  const absl::StatusOr<VerbArguments> verb = VerbArgumentsFrom(target, message);
  return verb.ok() ? CallFunction(call, message.verb, verb->values).status() : verb.status();
}

}  // namespace tessera::game
