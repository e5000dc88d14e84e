#include "registration.h"

#include <array>
#include <deque>
#include <string>
#include <vector>

#include "engine.h"
#include "world_node.h"

namespace godot_plugin {
namespace {

constexpr const char *kClass = "TesseraWorld", *kParent = "Node3D";
using Given = std::vector<Value>;

struct Argument {
  const char* name;
  abi::Type type;  // kNil: any
};
struct Method {
  const char* name;
  bool has_result;
  abi::Type result;  // kNil: any; kObject: a Node3D or null
  std::vector<Argument> arguments;
  Value (*call)(WorldNode& world, const Given& given);
};
struct Property {
  const char* name;
  abi::Type type;
  const char* choices;  // "": no enumeration
};
struct Signal {
  const char* name;
  std::vector<Argument> arguments;
};

Value CodeOf(tessera_code code) { return Value(static_cast<std::int64_t>(code)); }
Value CountOf(std::uint64_t number) { return Value(static_cast<std::int64_t>(number)); }
std::uint64_t IdIn(const Value& value) { return static_cast<std::uint64_t>(value.AsInt()); }

template <std::string WorldNode::*kMember>
Value GetText(WorldNode& world, const Given&) {
  return Value(std::string_view(world.*kMember));
}
template <std::string WorldNode::*kMember>
Value SetText(WorldNode& world, const Given& given) {
  world.*kMember = given[0].AsText();
  return Value();
}

Value SetDrawing(WorldNode& world, const Given& given) {
  const std::int64_t drawing = given[0].AsInt();
  if (drawing < 0 || drawing > static_cast<std::int64_t>(Drawing::kMultiMesh)) {
    ReportError("drawing: " + std::to_string(drawing) + " is none of 0, 1, 2");
  } else {
    world.drawing = static_cast<Drawing>(drawing);
  }
  return Value();
}

Value Steer(WorldNode& world, const Given& given) {
  tessera_steering steering = TESSERA_STEERING;
  const std::array<double, 2> move = given[0].AsVector2();
  steering.move[0] = static_cast<float>(move[0]);
  steering.move[1] = static_cast<float>(move[1]);
  steering.yaw = static_cast<float>(given[1].AsReal());
  steering.pitch = static_cast<float>(given[2].AsReal());
  steering.buttons = static_cast<std::uint32_t>(given[3].AsInt());
  world.Steer(steering);
  return Value();
}

Value SendText(WorldNode& world, const Given& given) {
  const std::string command = given[0].AsText();
  return CodeOf(world.Send(command.data(), command.size()));
}

Value SendBytes(WorldNode& world, const Given& given) {
  const std::vector<std::uint8_t> command = given[0].AsBytes();
  return CodeOf(world.Send(command.data(), command.size()));
}

// Methods are given to the engine by address, so the list never moves.
const std::vector<Method>& Methods() {
  using W = WorldNode;
  using G = Given;
  static const std::vector<Method> methods = {
      {"join", true, abi::kInt, {}, [](W& w, const G&) { return CodeOf(w.Join()); }},
      {"renew",
       true,
       abi::kInt,
       {{"grant", abi::kPackedBytes}},
       [](W& w, const G& given) { return CodeOf(w.Renew(given[0].AsBytes())); }},
      {"leave",
       true,
       abi::kInt,
       {{"deadline_ms", abi::kInt}},
       [](W& w, const G& given) { return CodeOf(w.Leave(static_cast<std::uint32_t>(given[0].AsInt()))); }},
      {"send", true, abi::kInt, {{"command", abi::kString}}, SendText},
      {"send_bytes", true, abi::kInt, {{"command", abi::kPackedBytes}}, SendBytes},
      {"push",
       false,
       abi::kNil,
       {{"force", abi::kVector3}, {"torque", abi::kVector3}},
       [](W& w, const G& given) {
         w.Push(given[0].AsVector3(), given[1].AsVector3());
         return Value();
       }},
      {"steer",
       false,
       abi::kNil,
       {{"move", abi::kVector2}, {"yaw", abi::kFloat}, {"pitch", abi::kFloat}, {"buttons", abi::kInt}},
       Steer},
      {"get_state", true, abi::kInt, {}, [](W& w, const G&) { return CodeOf(w.state()); }},
      {"get_player", true, abi::kInt, {}, [](W& w, const G&) { return CountOf(w.player()); }},
      {"get_own_body", true, abi::kInt, {}, [](W& w, const G&) { return CountOf(w.own_body()); }},
      {"get_last_error", true, abi::kString, {}, [](W& w, const G&) { return Value(w.last_error()); }},
      {"body_node",
       true,
       abi::kObject,
       {{"id", abi::kInt}},
       [](W& w, const G& given) { return w.BodyNode(IdIn(given[0])); }},
      {"body_property",
       true,
       abi::kNil,
       {{"id", abi::kInt}, {"name", abi::kString}},
       [](W& w, const G& given) { return w.BodyProperty(IdIn(given[0]), given[1].AsText()); }},
      {"world_property",
       true,
       abi::kNil,
       {{"name", abi::kString}},
       [](W& w, const G& given) { return w.WorldProperty(given[0].AsText()); }},
      {"get_grant",
       true,
       abi::kPackedBytes,
       {},
       [](W& w, const G&) { return Value::Bytes(w.grant.data(), w.grant.size()); }},
      {"set_grant",
       false,
       abi::kNil,
       {{"value", abi::kPackedBytes}},
       [](W& w, const G& given) {
         w.grant = given[0].AsBytes();
         return Value();
       }},
      {"get_drawing", true, abi::kInt, {}, [](W& w, const G&) { return Value(static_cast<std::int64_t>(w.drawing)); }},
      {"set_drawing", false, abi::kNil, {{"value", abi::kInt}}, SetDrawing},
      {"get_predict", true, abi::kBool, {}, [](W& w, const G&) { return Value(w.predict); }},
      {"set_predict",
       false,
       abi::kNil,
       {{"value", abi::kBool}},
       [](W& w, const G& given) {
         w.predict = given[0].AsBool();
         return Value();
       }},
      {"get_grant_file", true, abi::kString, {}, GetText<&W::grant_file>},
      {"set_grant_file", false, abi::kNil, {{"value", abi::kString}}, SetText<&W::grant_file>},
      {"get_address", true, abi::kString, {}, GetText<&W::address>},
      {"set_address", false, abi::kNil, {{"value", abi::kString}}, SetText<&W::address>},
      {"get_instance", true, abi::kString, {}, GetText<&W::instance>},
      {"set_instance", false, abi::kNil, {{"value", abi::kString}}, SetText<&W::instance>},
      {"get_player_name", true, abi::kString, {}, GetText<&W::player_name>},
      {"set_player_name", false, abi::kNil, {{"value", abi::kString}}, SetText<&W::player_name>},
      {"get_scene_cache_folder", true, abi::kString, {}, GetText<&W::scene_cache_folder>},
      {"set_scene_cache_folder", false, abi::kNil, {{"value", abi::kString}}, SetText<&W::scene_cache_folder>},
  };
  return methods;
}

// Each has a getter and a setter by its name among the methods.
const std::vector<Property> kProperties = {
    {"grant", abi::kPackedBytes, ""},
    {"grant_file", abi::kString, ""},
    {"address", abi::kString, ""},
    {"instance", abi::kString, ""},
    {"player_name", abi::kString, ""},
    {"scene_cache_folder", abi::kString, ""},
    {"drawing", abi::kInt, "Nothing,Nodes,MultiMesh"},
    {"predict", abi::kBool, ""},
};

const std::vector<Signal> kSignals = {
    {"joined", {{"player", abi::kInt}, {"scene", abi::kString}}},
    {"left", {{"reason", abi::kString}}},
    {"body_entered", {{"id", abi::kInt}, {"node", abi::kObject}}},
    {"body_left", {{"id", abi::kInt}}},
    {"event", {{"event", abi::kDictionary}}},
    {"game_event", {{"name", abi::kString}, {"values", abi::kDictionary}}},
};

// Descriptions of values, which the engine copies; all that they point to lives as long as this.
class Descriptions {
 public:
  abi::PropertyInfo Of(const Argument& argument, const char* choices = "") {
    void* name = names_.emplace_back(argument.name).get();
    void* class_name = names_.emplace_back(argument.type == abi::kObject ? kParent : "").get();
    void* hint = texts_.emplace_back(choices).get();
    return {
        argument.type, name,
        class_name,    *choices == 0 ? abi::kHintNone : abi::kHintEnum,
        hint,          argument.type == abi::kNil ? abi::kUsageDefault | abi::kUsageNilIsVariant : abi::kUsageDefault};
  }

 private:
  std::deque<Name> names_;
  std::deque<Text> texts_;
};

// Whether the engine's value may stand for the argument.
bool Fits(abi::Type wanted, abi::Type given) {
  if (wanted == abi::kNil || wanted == given) return true;
  if (wanted == abi::kFloat || wanted == abi::kInt) return given == abi::kFloat || given == abi::kInt;
  return wanted == abi::kString && given == abi::kStringName;
}

void Call(void* userdata, void* instance, const void* const* arguments, std::int64_t count, void* result,
          abi::CallError* error) {
  const auto& method = *static_cast<const Method*>(userdata);
  const auto wanted = static_cast<std::int64_t>(method.arguments.size());
  *error = {abi::kCallOk, 0, 0};
  if (count != wanted) {
    const auto expected = static_cast<std::int32_t>(wanted);
    *error = {count < wanted ? abi::kTooFewArguments : abi::kTooManyArguments, expected, expected};
    return;
  }
  Given given;
  given.reserve(method.arguments.size());
  for (std::size_t i = 0; i < method.arguments.size(); ++i) {
    if (!Fits(method.arguments[i].type, Engine().variant_type(arguments[i]))) {
      *error = {abi::kInvalidArgument, static_cast<std::int32_t>(i), method.arguments[i].type};
      return;
    }
    given.push_back(Value::FromType(abi::kNil, arguments[i]));
  }
  method.call(*static_cast<WorldNode*>(instance), given).AssignTo(abi::kNil, result);
}

void TypedCall(void* userdata, void* instance, const void* const* arguments, void* result) {
  const auto& method = *static_cast<const Method*>(userdata);
  Given given;
  given.reserve(method.arguments.size());
  for (std::size_t i = 0; i < method.arguments.size(); ++i) {
    given.push_back(Value::FromType(method.arguments[i].type, arguments[i]));
  }
  const Value gives = method.call(*static_cast<WorldNode*>(instance), given);
  if (method.has_result) gives.AssignTo(method.result, result);
}

void* Create(void*) {
  void* object = Engine().construct_object(Name(kParent).get());
  Engine().object_set_instance(object, Name(kClass).get(), new WorldNode(object));
  return object;
}

void Free(void*, void* instance) { delete static_cast<WorldNode*>(instance); }

void Notify(void* instance, std::int32_t what, std::uint8_t) { static_cast<WorldNode*>(instance)->Notify(what); }

void RegisterMethod(const Name& class_name, const Method& method) {
  Descriptions descriptions;
  Name name(method.name);
  std::vector<abi::PropertyInfo> arguments;
  arguments.reserve(method.arguments.size());
  for (const Argument& argument : method.arguments) arguments.push_back(descriptions.Of(argument));
  std::vector<std::int32_t> metadata(arguments.size());
  abi::PropertyInfo result = descriptions.Of({"", method.result});
  abi::MethodInfo info{};
  info.name = name.get();
  info.userdata = const_cast<Method*>(&method);
  info.call = Call;
  info.typed_call = TypedCall;
  info.flags = abi::kMethodFlagsDefault;
  info.has_result = method.has_result ? 1 : 0;
  info.result = method.has_result ? &result : nullptr;
  info.argument_count = static_cast<std::uint32_t>(arguments.size());
  info.arguments = arguments.data();
  info.argument_metadata = metadata.data();
  Engine().register_method(Engine().library, class_name.get(), &info);
}

}  // namespace

void RegisterWorld() {
  const Name class_name(kClass), parent(kParent);
  abi::ClassInfo info{};
  info.is_exposed = 1;
  info.notification = Notify;
  info.create = Create;
  info.free = Free;
  Engine().register_class(Engine().library, class_name.get(), parent.get(), &info);
  for (const Method& method : Methods()) RegisterMethod(class_name, method);
  for (const Property& property : kProperties) {
    Descriptions descriptions;
    const abi::PropertyInfo described = descriptions.Of({property.name, property.type}, property.choices);
    const Name setter((std::string("set_") + property.name).c_str()),
        getter((std::string("get_") + property.name).c_str());
    Engine().register_property(Engine().library, class_name.get(), &described, setter.get(), getter.get());
  }
  for (const Signal& signal : kSignals) {
    Descriptions descriptions;
    std::vector<abi::PropertyInfo> arguments;
    arguments.reserve(signal.arguments.size());
    for (const Argument& argument : signal.arguments) arguments.push_back(descriptions.Of(argument));
    Engine().register_signal(Engine().library, class_name.get(), Name(signal.name).get(), arguments.data(),
                             static_cast<std::int64_t>(arguments.size()));
  }
}

void UnregisterWorld() { Engine().unregister_class(Engine().library, Name(kClass).get()); }

}  // namespace godot_plugin
