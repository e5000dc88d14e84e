#include "world_node.h"

#include <array>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "connect_library.h"

namespace godot_plugin {
namespace {

Value NumberOf(std::uint64_t number) { return Value(static_cast<std::int64_t>(number)); }
Value VectorOf(const double* v) { return Value(std::array<double, 3>{v[0], v[1], v[2]}); }
Value TextOf(const char* text) { return Value(text == nullptr ? "" : text); }

Value ValueOf(const tessera_game_event_field& field) {
  switch (field.type) {
    case TESSERA_FIELD_BOOL:
      return Value(field.integer != 0);
    case TESSERA_FIELD_REAL:
      return Value(field.real);
    case TESSERA_FIELD_TEXT:
      return Value(std::string_view(field.text, field.text_size));
    case TESSERA_FIELD_VECTOR:
      return VectorOf(field.vector);
    default:
      return Value(field.integer);
  }
}

Value ValueOf(const tessera_property& property) {
  switch (property.type) {
    case TESSERA_PROPERTY_BOOL:
      return Value(property.integer != 0);
    case TESSERA_PROPERTY_REAL:
      return Value(property.real);
    case TESSERA_PROPERTY_TEXT:
      return Value(static_cast<const char*>(property.text));
    case TESSERA_PROPERTY_VECTOR:
      return VectorOf(property.vector);
    case TESSERA_PROPERTY_BODY:
      return NumberOf(property.body);
    case TESSERA_PROPERTY_BYTES:
      return Value::Bytes(property.bytes, property.byte_count);
    default:
      return Value(property.integer);
  }
}

Value DictionaryOf(const tessera_event& event) {
  Value all = Value::Dictionary();
  all.Set(Value("kind"), Value(static_cast<std::int64_t>(event.kind)));
  all.Set(Value("body"), NumberOf(event.body));
  all.Set(Value("other"), NumberOf(event.other));
  all.Set(Value("region"), NumberOf(event.region));
  all.Set(Value("input"), NumberOf(event.input));
  all.Set(Value("detail"), TextOf(event.detail));
  all.Set(Value("property"), TextOf(event.property));
  all.Set(Value("contact_point"), VectorOf(event.contact_point));
  all.Set(Value("contact_normal"), VectorOf(event.contact_normal));
  all.Set(Value("contact_impulse"), Value(event.contact_impulse));
  all.Set(Value("tile"), Value(static_cast<std::int64_t>(event.tile)));
  all.Set(Value("since_before"), Value((event.flags & TESSERA_EVENT_SINCE_BEFORE) != 0));
  return all;
}

bool InEditor() {
  void* engine = Engine().singleton(Name("Engine").get());
  return engine != nullptr && Value::Object(engine).Call("is_editor_hint").AsBool();
}

}  // namespace

void WorldNode::Notify(std::int32_t what) {
  if (what == abi::kNotificationReady && !InEditor()) {
    Value::Object(object_).Call("set_process", Value(true));
    if (!grant.empty() || !grant_file.empty() || !address.empty()) Join();
  }
  if (what == abi::kNotificationProcess && client_ != nullptr) Frame();
}

// A path of the engine's as the system has it.
std::string WorldNode::Globalized(const std::string& path) const {
  void* settings = Engine().singleton(Name("ProjectSettings").get());
  if (path.empty() || settings == nullptr) return path;
  return Value::Object(settings).Call("globalize_path", Value(path)).AsText();
}

tessera_code WorldNode::Granted(std::vector<std::uint8_t>& granted) {
  granted = grant;
  if (!granted.empty()) return TESSERA_OK;
  if (grant_file.empty()) return GetGrant(address, instance, player_name, granted);
  std::ifstream file(Globalized(grant_file), std::ios::binary);
  granted.assign(std::istreambuf_iterator<char>(file), {});
  if (!granted.empty()) return TESSERA_OK;
  return tessera_set_last_error(TESSERA_NOT_FOUND, ("grant_file: cannot be read: " + grant_file).c_str());
}

tessera_code WorldNode::Join() {
  if (client_ != nullptr) {
    return Fail(tessera_set_last_error(TESSERA_FAILED_PRECONDITION, "join: there is a world already; leave it first"));
  }
  std::vector<std::uint8_t> granted;
  tessera_code code = Granted(granted);
  if (code == TESSERA_OK) {
    const std::string folder = Globalized(scene_cache_folder);
    tessera_grant_options options = TESSERA_GRANT_OPTIONS;
    options.flags = predict ? TESSERA_JOIN_PREDICT : 0;
    options.scene_cache_dir = folder.empty() ? nullptr : folder.c_str();
    code = tessera_join_grant(granted.data(), granted.size(), &options, &client_);
  }
  if (code != TESSERA_OK) {
    Fail(code);
    Close(last_error_);
    return code;
  }
  last_error_.clear();
  ++joins_;
  bodies_.Draw(drawing);
  return TESSERA_OK;
}

tessera_code WorldNode::Renew(const std::vector<std::uint8_t>& newer) {
  return Fail(tessera_renew(client_, newer.data(), newer.size()));
}

tessera_code WorldNode::Leave(std::uint32_t deadline_ms) {
  const tessera_code code = Fail(tessera_leave(client_, deadline_ms));
  if (client_ != nullptr) Close("");
  return code;
}

tessera_code WorldNode::Send(const void* bytes, std::size_t size) { return Fail(tessera_send(client_, bytes, size)); }

void WorldNode::Push(const std::array<double, 3>& force, const std::array<double, 3>& torque) {
  const auto f = [](double number) { return static_cast<float>(number); };
  const std::array<float, 3> pushed = {f(force[0]), f(force[1]), f(force[2])};
  const std::array<float, 3> turned = {f(torque[0]), f(torque[1]), f(torque[2])};
  tessera_move(client_, pushed.data(), turned.data());
}

void WorldNode::Steer(const tessera_steering& steering) { tessera_steer(client_, &steering); }

// Keeps the line of a code that is an error, and gives the code back.
tessera_code WorldNode::Fail(tessera_code code) {
  if (code != TESSERA_OK) {
    last_error_ = tessera_last_error();
    ReportError(last_error_);
  }
  return code;
}

void WorldNode::Close(const std::string& reason) {
  bodies_.Clear();
  tessera_close(client_);
  client_ = nullptr;
  inside_ = false;
  ++joins_;
  Emit("left", Value(reason));
}

// Where a script left while a signal reached it, the rest of this frame is of a world that is gone.
void WorldNode::Frame() {
  const std::uint64_t mine = joins_;
  const std::int64_t now_ns = tessera_now();
  const tessera_code code = tessera_poll(client_, now_ns);
  const std::string line = code == TESSERA_OK ? "" : tessera_last_error();
  if (!inside_ && (state() == TESSERA_WAITING || state() == TESSERA_PLAYING)) {
    inside_ = true;
    bodies_.TakeScene(client_);
    tessera_scene_info scene = TESSERA_SCENE_INFO;
    tessera_get_scene(client_, &scene);
    Emit("joined", NumberOf(player()), TextOf(scene.name));
  }
  if (joins_ == mine) TellEvents();
  if (joins_ == mine) TellGameEvents();
  if (joins_ != mine) return;
  if (state() != TESSERA_ENDED) {
    TellChanges(bodies_.Update(client_, now_ns));
    return;
  }
  std::string reason(tessera_disconnect_reason(client_, nullptr, 0) + 1, 0);
  tessera_disconnect_reason(client_, reason.data(), reason.size());
  reason.pop_back();
  if (code != TESSERA_OK) last_error_ = line;
  Close(reason.empty() ? line : reason);
}

void WorldNode::TellEvents() {
  const std::uint64_t mine = joins_;
  tessera_event event = TESSERA_EVENT;
  while (joins_ == mine && tessera_next_event(client_, &event) != 0) {
    if (event.kind == TESSERA_EVENT_TILE_CAME) bodies_.TakeTile(client_, event.tile);
    if (event.kind == TESSERA_EVENT_TILE_GONE) bodies_.DropTile(event.tile);
    // body_entered and body_left say more than these two.
    if (event.kind == TESSERA_EVENT_APPEARED || event.kind == TESSERA_EVENT_VANISHED) continue;
    Emit("event", DictionaryOf(event));
  }
}

void WorldNode::TellGameEvents() {
  const std::uint64_t mine = joins_;
  tessera_game_event event = TESSERA_GAME_EVENT;
  while (joins_ == mine && tessera_next_game_event(client_, &event) != 0) {
    Value values = Value::Dictionary();
    for (std::size_t i = 0; i < event.field_count; ++i) {
      tessera_game_event_field field = TESSERA_GAME_EVENT_FIELD;
      if (tessera_game_event_field_at(client_, i, &field) == TESSERA_OK) values.Set(Value(field.name), ValueOf(field));
    }
    Emit("game_event", TextOf(event.name), values);
  }
}

void WorldNode::TellChanges(const Bodies::Changes& changes) {
  const std::uint64_t mine = joins_;
  for (const std::uint64_t id : changes.left) {
    if (joins_ == mine) Emit("body_left", NumberOf(id));
  }
  for (const std::uint64_t id : changes.entered) {
    if (joins_ == mine) Emit("body_entered", NumberOf(id), BodyNode(id));
  }
}

Value WorldNode::BodyNode(std::uint64_t id) const { return Value::Object(bodies_.NodeOf(id)); }

Value WorldNode::BodyProperty(std::uint64_t id, const std::string& name) const {
  tessera_property property = TESSERA_PROPERTY;
  if (tessera_get_property(client_, id, name.c_str(), &property) != TESSERA_OK) return Value();
  return ValueOf(property);
}

Value WorldNode::WorldProperty(const std::string& name) const {
  tessera_property property = TESSERA_PROPERTY;
  if (tessera_get_world_property(client_, name.c_str(), &property) != TESSERA_OK) return Value();
  return ValueOf(property);
}

}  // namespace godot_plugin
