#include "core/game/calls.h"

#include <algorithm>
#include <limits>
#include <optional>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/game/arguments.h"
#include "core/game/blast_calls.h"
#include "core/game/body_calls.h"
#include "core/game/clock_calls.h"
#include "core/game/control_calls.h"
#include "core/game/joint_calls.h"
#include "core/game/message_calls.h"
#include "core/game/player_calls.h"
#include "core/game/query_calls.h"
#include "core/game/spawn_calls.h"
#include "game_sdk/api/api.h"

namespace tessera::game {
namespace {

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

absl::StatusOr<tessera_game_value> CallWorld(tessera_game_call& call, const Function& function,
                                             CallArguments arguments) {
  switch (function.number) {
    case kWorldSpawn:
      return CallSpawn(call, function, arguments);
    case kWorldTick:
      return ToInterface(GameValue(static_cast<std::int64_t>(call.tick.value())));
    case kWorldTickRate:
      return ToInterface(GameValue(static_cast<double>(call.transaction.world().scene().tick_rate_hz)));
    case kWorldRandom:
      return ToInterface(GameValue(Random(call)));
    case kWorldLog:
      call.transaction.Log(OneLine(TextGiven(arguments[0])));
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
      return absl::InternalError(absl::StrCat(ViewOf(function.name), ": is not there yet"));
  }
  return tessera_game_value{};
}

absl::StatusOr<tessera_game_value> CallFunction(tessera_game_call& call, std::uint32_t number,
                                                CallArguments arguments) {
  const Function* function = FindFunction(number);
  if (function == nullptr) return absl::NotFoundError(absl::StrCat("there is no function ", number));
  if (function->receiver == Receiver::kWorld) {
    if (absl::Status status = CheckArguments(*function, arguments); !status.ok()) return status;
    return CallWorld(call, *function, arguments);
  }
  if (function->receiver == Receiver::kPlayer) {
    if (arguments.empty() || arguments[0].type != TESSERA_GAME_PLAYER) {
      return ArgumentFault(function->name, "is called for a player");
    }
    if (absl::Status status = CheckArguments(*function, arguments.subspan(1)); !status.ok()) return status;
    if (arguments[0].as.id == 0 || arguments[0].as.id > UINT32_MAX) {
      return absl::NotFoundError(absl::StrCat(ViewOf(function->name), ": there is no player ", arguments[0].as.id));
    }
    return CallPlayer(call, *function, PlayerNumber(static_cast<std::uint32_t>(arguments[0].as.id)),
                      arguments.subspan(1));
  }
  if (arguments.empty() || arguments[0].type != TESSERA_GAME_BODY)
    return ArgumentFault(function->name, "is called for a body");
  if (absl::Status status = CheckArguments(*function, arguments.subspan(1)); !status.ok()) return status;
  return CallBody(call, *function, BodyId(arguments[0].as.id), arguments.subspan(1));
}

// --- The interface

[[gnu::noinline]] int CallAny(tessera_game_call* call, std::uint32_t function, CallArguments arguments,
                              tessera_game_value* result) {
  const std::optional<Effect> effect = EffectOf(function);
  const std::size_t sent = call->transaction.sent();
  const auto returned = CallFunction(*call, function, arguments);
  if (effect) {
    // A task for another region is a message here, and an effect there.
    const bool elsewhere = returned.ok() && IsVerb(function) && call->transaction.sent() > sent;
    if (!call->effects) call->effects.emplace();
    EffectCount& count = (*call->effects)[static_cast<std::size_t>(elsewhere ? Effect::kMessage : *effect)];
    ++(returned.ok() ? count.done : count.refused);
  }
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
