#include "core/game/message_calls.h"

#include <algorithm>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/game/record_calls.h"
#include "core/game/settings.h"
#include "core/world/prefab.h"
#include "core/world/spawned_id.h"

namespace tessera::game {
namespace {

using MessageArguments = std::span<const tessera_game_value>;

// In the message of a verb: the ticks of `after`, whose other fields are the timer's values; and the arguments of any
// other verb, by their places, or as bytes where there are rotations or tables among them. No field of a game has a
// name that comes before these.
constexpr char kTicksField[] = "\x01", kArgumentsField[] = "\x02";

absl::string_view Shown(std::string_view text) { return {text.data(), text.size()}; }

absl::Status MessageFault(const Function& function, absl::string_view what) {
  return absl::InvalidArgumentError(absl::StrCat(Shown(function.name), ": ", what));
}

tessera_game_value Returned(const GameValue& value) { return ToInterface(value); }

BodyId CarrierOf(const tessera_game_call& call) {
  if (call.self == BodyId() || call.self == kInstanceBody) return kInstanceBody;
  const BodyDef* def = call.transaction.world().Find(call.self);
  const bool moves = def == nullptr || def->motion == Motion::kDynamic;
  if (moves) return call.self;
  return call.other != BodyId() ? call.other : kInstanceBody;
}

absl::Status Send(tessera_game_call& call, const Function& function, BodyId target, Message message) {
  message.speaker = call.self == kInstanceBody ? BodyId() : call.self;
  const absl::Status status = call.transaction.Send(CarrierOf(call), target, call.tick, std::move(message));
  return status.ok() ? status : absl::Status(status.code(), absl::StrCat(Shown(function.name), ": ", status.message()));
}

absl::Status CheckTarget(const tessera_game_call& call, const Function& function, BodyId target) {
  const BodyDef* here = call.transaction.Find(target);
  const BodyDef* def = here != nullptr ? here : DefinitionOf(call.transaction.world().scene(), target);
  if (def == nullptr) {
    return absl::NotFoundError(absl::StrCat(Shown(function.name), ": there is no body ", target.value()));
  }
  if (def->motion == Motion::kStatic) {
    return MessageFault(function, absl::StrCat("body ", target.value(), " does not move, and gets no messages"));
  }
  return absl::OkStatus();
}

absl::Status PutFields(const Function& function, const GameFields& fields, std::size_t limit, Message& message) {
  auto bytes = EncodeFields(fields, limit);
  if (!bytes.ok())
    return absl::Status(bytes.status().code(), absl::StrCat(Shown(function.name), ": ", bytes.status().message()));
  message.values = *std::move(bytes);
  return absl::OkStatus();
}

// `after` of a body of another region: as the owner will check it.
absl::Status WriteAfter(const tessera_game_call& call, const Function& function, MessageArguments arguments,
                        Message& message) {
  GameRecord tried;
  if (const auto timer = SetTimer(call.tick, arguments, tried); !timer.ok()) return timer.status();
  message.name = tried.timers.front().name;
  GameFields fields = *DecodeFields(tried.timers.front().values);
  if (!fields.empty() && fields.front().first <= kTicksField)
    return MessageFault(function, "`values`: a name is empty");
  fields.insert(fields.begin(), {kTicksField, arguments[0].as.whole});
  return PutFields(function, fields, kMaxMessageBytes, message);
}

// A value of any type but a list; a table holds no tables. False: it cannot be written.
bool Pack(ByteWriter& out, const tessera_game_value& value, bool within = false) {
  out.U8(static_cast<std::uint8_t>(value.type));
  switch (value.type) {
    case TESSERA_GAME_NOTHING:
      return true;
    case TESSERA_GAME_FLAG:
    case TESSERA_GAME_WHOLE:
      out.U64(static_cast<std::uint64_t>(value.as.whole));
      return true;
    case TESSERA_GAME_REAL:
      out.F64(value.as.real);
      return true;
    case TESSERA_GAME_TEXT:
      out.Block(std::string_view(value.as.text, value.count));
      return true;
    case TESSERA_GAME_VECTOR:
      out.V(Vec3d{value.as.vector[0], value.as.vector[1], value.as.vector[2]});
      return true;
    case TESSERA_GAME_ROTATION:
      out.Q(Quatd{value.as.rotation[0], value.as.rotation[1], value.as.rotation[2], value.as.rotation[3]});
      return true;
    case TESSERA_GAME_BODY:
    case TESSERA_GAME_PLAYER:
      out.Varint(value.as.id);
      return true;
    case TESSERA_GAME_FIELDS:
      out.Varint(value.count);
      return !within &&
             std::ranges::all_of(std::span(value.as.fields, value.count), [&](const tessera_game_field& field) {
               out.Block(std::string_view(field.name, field.name_bytes));
               return Pack(out, field.value, true);
             });
    default:
      return false;
  }
}

// Leaves a failed reader where the bytes are not those that Pack writes.
void Unpack(ByteReader& in, VerbArguments& verb, tessera_game_value& value, bool within = false) {
  const auto text = [&]() -> std::string& {
    const auto bytes = in.Block(kMaxMessageBytes);
    return verb.texts.emplace_back(bytes.begin(), bytes.end());
  };
  value.type = in.U8();
  switch (value.type) {
    case TESSERA_GAME_NOTHING:
      return;
    case TESSERA_GAME_FLAG:
    case TESSERA_GAME_WHOLE:
      value.as.whole = static_cast<std::int64_t>(in.U64());
      return;
    case TESSERA_GAME_REAL:
      value.as.real = in.F64();
      return;
    case TESSERA_GAME_TEXT: {
      const std::string& kept = text();
      value.count = static_cast<std::uint32_t>(kept.size());
      value.as.text = kept.data();
      return;
    }
    case TESSERA_GAME_VECTOR: {
      const Vec3d v = in.V3d();
      value.as.vector[0] = v.x, value.as.vector[1] = v.y, value.as.vector[2] = v.z;
      return;
    }
    case TESSERA_GAME_ROTATION: {
      const Quatd q = in.Q();
      value.as.rotation[0] = q.x, value.as.rotation[1] = q.y, value.as.rotation[2] = q.z, value.as.rotation[3] = q.w;
      return;
    }
    case TESSERA_GAME_BODY:
    case TESSERA_GAME_PLAYER:
      value.as.id = in.Varint();
      return;
    case TESSERA_GAME_FIELDS: {
      if (within) return in.Fail("a table in a table");
      std::vector<tessera_game_field>& fields = verb.tables.emplace_back(in.Count(2));
      for (tessera_game_field& field : fields) {
        const std::string& name = text();
        field.name = name.data();
        field.name_bytes = name.size();
        Unpack(in, verb, field.value, true);
      }
      value.count = static_cast<std::uint32_t>(fields.size());
      value.as.fields = fields.data();
      return;
    }
    default:
      in.Fail("an argument of an unknown type");
  }
}

absl::Status PackArguments(const Function& function, MessageArguments arguments, Message& message) {
  ByteWriter out;
  for (const tessera_game_value& argument : arguments) {
    if (!Pack(out, argument)) return MessageFault(function, "an argument cannot be sent");
  }
  const std::vector<std::uint8_t> bytes = out.Take();
  return PutFields(function, {{kArgumentsField, std::string(bytes.begin(), bytes.end())}}, kMaxMessageBytes, message);
}

absl::Status UnpackArguments(const std::string& packed, VerbArguments& verb) {
  const std::vector<std::uint8_t> bytes(packed.begin(), packed.end());
  ByteReader in(bytes);
  while (in.ok() && in.remaining() > 0) Unpack(in, verb, verb.values.emplace_back());
  return in.ok() ? absl::OkStatus() : absl::InvalidArgumentError("arguments of a verb that are not sound");
}

absl::Status WriteArguments(const Function& function, MessageArguments arguments, Message& message) {
  GameFields fields;
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    const bool last = i + 1 == arguments.size();
    if (arguments[i].type == TESSERA_GAME_NOTHING && last) continue;
    std::optional<GameValue> kept = FromInterface(arguments[i]);
    if (!kept) return PackArguments(function, arguments, message);
    fields.emplace_back(std::string(1, static_cast<char>('1' + i)), *std::move(kept));
  }
  return PutFields(function, fields, kMaxMessageBytes, message);
}

absl::StatusOr<tessera_game_value> ChangeInstance(tessera_game_call& call, const Function& function,
                                                  MessageArguments arguments) {
  Transaction::Changes* const world = call.transaction.Own(kInstanceBody);
  if (world == nullptr) {
    return absl::FailedPreconditionError(absl::StrCat(
        Shown(function.name), ": the world's record is owned by another region; send the world a message"));
  }
  const std::vector<PropertyDef>& declared = call.transaction.world().scene().instance_properties;
  if (function.number == kWorldSet) {
    const absl::Status status =
        SetProperty(declared, {arguments[0].as.text, arguments[0].count}, arguments[1], world->properties);
    if (!status.ok()) return status;
    return tessera_game_value{};
  }
  if (function.number == kWorldCancel) return Returned(CancelTimer(world->record, arguments[0].as.whole));
  const absl::StatusOr<std::int64_t> timer = SetTimer(call.tick, arguments, world->record);
  if (!timer.ok()) return timer.status();
  return Returned(*timer);
}

}  // namespace

const BodyDef* DefinitionOf(const Scene& scene, BodyId id) {
  if (IsPlayerBody(id)) return scene.player.has_value() ? &scene.player->body : nullptr;
  if (IsSpawned(id)) return PrefabBodyOf(scene, id);
  const auto at = std::ranges::lower_bound(scene.bodies, id, {}, &BodyDef::id);
  return at != scene.bodies.end() && at->id == id ? &*at : nullptr;
}

absl::Status SendFrom(tessera_game_call& call, const Function& function, BodyId target, Message message) {
  return Send(call, function, target, std::move(message));
}

absl::Status SendAs(tessera_game_call& call, const Function& function, BodyId carrier, BodyId target, Message message) {
  if (absl::Status status = CheckTarget(call, function, target); !status.ok()) return status;
  message.speaker = carrier;
  const absl::Status status = call.transaction.Send(carrier, target, call.tick, std::move(message));
  return status.ok() ? status : absl::Status(status.code(), absl::StrCat(Shown(function.name), ": ", status.message()));
}

absl::StatusOr<tessera_game_value> CallSend(tessera_game_call& call, const Function& function, BodyId target,
                                            std::span<const tessera_game_value> arguments) {
  if (target != kInstanceBody) {
    if (absl::Status status = CheckTarget(call, function, target); !status.ok()) return status;
  }
  Message message;
  if (function.number == kWorldPublish) message.verb = kWorldPublish;
  message.name.assign(arguments[0].as.text, arguments[0].count);
  if (message.name.empty() || message.name.size() > kMaxMessageNameBytes) {
    return MessageFault(function, "`name` must have 1 to 32 bytes");
  }
  if (arguments.size() > 1 && arguments[1].type != TESSERA_GAME_NOTHING) {
    const auto fields = FieldsFrom(arguments[1]);
    if (!fields.ok()) return MessageFault(function, fields.status().message());
    if (absl::Status status = PutFields(function, *fields, kMaxMessageBytes, message); !status.ok()) return status;
  }
  if (absl::Status status = Send(call, function, target, std::move(message)); !status.ok()) return status;
  return tessera_game_value{};
}

absl::StatusOr<tessera_game_value> CallInstance(tessera_game_call& call, const Function& function,
                                                std::span<const tessera_game_value> arguments) {
  switch (function.number) {
    case kWorldSend:
    case kWorldPublish:
      return CallSend(call, function, kInstanceBody, arguments);
    case kWorldIsOwn:
      return Returned(call.transaction.Owns(kInstanceBody));
    case kWorldGet: {
      const std::vector<PropertyDef>& declared = call.transaction.world().scene().instance_properties;
      return GetProperty(call, declared, {}, call.transaction.PropertiesOf(kInstanceBody),
                         {arguments[0].as.text, arguments[0].count});
    }
    default:
      return ChangeInstance(call, function, arguments);
  }
}

bool IsVerb(std::uint32_t function) {
  switch (function) {
    case kBodySet:
    case kBodyImpulse:
    case kBodySetVelocity:
    case kBodyAfter:
    case kBodyRemove:
    case kBodyExpireAfter:
    case kBodyPushFor:
    case kBodySetSpin:
    case kBodyTeleport:
    case kBodyWake:
    case kBodySetGravity:
    case kBodySetMaterial:
    case kBodyMoveTo:
    case kBodyShowTo:
    case kBodyConnect:
    case kBodyDisconnect:
      return true;
    default:
      return false;
  }
}

absl::StatusOr<tessera_game_value> SendVerb(tessera_game_call& call, const Function& function, BodyId target,
                                            std::span<const tessera_game_value> arguments) {
  if (absl::Status status = CheckTarget(call, function, target); !status.ok()) return status;
  Message message;
  message.verb = function.number;
  absl::Status status;
  if (function.number == kBodyAfter) {
    status = WriteAfter(call, function, arguments, message);
  } else {
    if (function.number == kBodySet) {
      const std::vector<PropertyDef>& declared = call.transaction.world().scene().properties;
      status = CheckProperty(declared, {arguments[0].as.text, arguments[0].count}, arguments[1]);
    }
    if (status.ok()) status = WriteArguments(function, arguments, message);
  }
  if (status.ok()) status = Send(call, function, target, std::move(message));
  if (!status.ok()) return status;
  return tessera_game_value{};
}

absl::StatusOr<VerbArguments> VerbArgumentsFrom(BodyId target, const Message& message) {
  if (!IsVerb(message.verb)) return absl::InvalidArgumentError("a message with an unknown verb");
  auto fields = DecodeFields(message.values, kMaxMessageBytes);
  if (!fields.ok()) return fields.status();
  VerbArguments verb;
  verb.kept = std::make_unique<GameFields>(*std::move(fields));
  verb.values.push_back(ToInterface(GameValue(target)));
  if (message.verb == kBodyAfter) {
    if (verb.kept->empty() || verb.kept->front().first != kTicksField) {
      return absl::InvalidArgumentError("after: a message without ticks");
    }
    verb.values.push_back(ToInterface(verb.kept->front().second));
    tessera_game_value name{};
    name.type = TESSERA_GAME_TEXT;
    name.count = static_cast<std::uint32_t>(message.name.size());
    name.as.text = message.name.data();
    verb.values.push_back(name);
    for (std::size_t i = 1; i < verb.kept->size(); ++i) {
      const auto& [field, value] = (*verb.kept)[i];
      verb.fields.push_back({field.data(), field.size(), ToInterface(value)});
    }
    tessera_game_value values{};
    values.type = TESSERA_GAME_FIELDS;
    values.count = static_cast<std::uint32_t>(verb.fields.size());
    values.as.fields = verb.fields.data();
    verb.values.push_back(values);
    return verb;
  }
  if (verb.kept->size() == 1 && verb.kept->front().first == kArgumentsField) {
    const auto* const packed = std::get_if<std::string>(&verb.kept->front().second);
    const absl::Status status =
        packed == nullptr ? absl::InvalidArgumentError("a verb without arguments") : UnpackArguments(*packed, verb);
    if (!status.ok()) return status;
    return verb;
  }
  for (const auto& [place, value] : *verb.kept) {
    const int index = place.size() == 1 ? place[0] - '0' : 0;
    if (index != static_cast<int>(verb.values.size())) {
      return absl::InvalidArgumentError("an argument of a verb is not in its place");
    }
    verb.values.push_back(ToInterface(value));
  }
  // A property that refers to no body: nothing is not sent.
  if (message.verb == kBodySet && verb.values.size() == 2) verb.values.push_back({});
  return verb;
}

}  // namespace tessera::game
