// Games in C++17: a thin wrapper of the C interface in <tessera/game.h>. EXPERIMENTAL, like that. Header only; needs
// nothing but the standard library.
//
//   #include <tessera/game.hpp>
//   using namespace tessera::native;
//
//   TESSERA_GAME_MODULE(game) {
//     game.on_tick([](World& world) { world.log("tick " + std::to_string(world.tick())); });
//     game.kind("ball")
//         .on_contact([](World& world, Body self, Body other) { self.set("hits", self.whole("hits") + 1); })
//         .on_timer([](World& world, Body self, const std::string& name, const Values& values) { self.remove(); });
//   }
//
// One such block makes a shared library a game: the block says once, when the library is loaded, which callbacks there
// are. What a callback asks for is done when it returns. An exception that leaves a callback discards all of it, and
// its text goes to the log; a refused function of the host throws an Error with the reason.
//
// Nothing may be kept between two callbacks, in no global, no static and no captured variable: the region may hand a
// body over, or die, after any of them. State belongs into properties and timers.
//
// Work: each function of the host counts as kWorkOfACall instructions. A loop of the game's own that may be long has to
// count itself with World::charge, which throws once the callback's budget is used up. One that never returns stops the
// worker.
//
// Thread rule: callbacks come one at a time; a World, and the bodies of it, live no longer than the callback.
#ifndef TESSERA_GAME_HPP
#define TESSERA_GAME_HPP

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <functional>
#include <initializer_list>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "game.h"

namespace tessera::native {

// Instructions that one function of the host counts as.
constexpr std::uint64_t kWorkOfACall = 20;

// Numbers of the table of functions, for World::call. docs/games.md lists what they do.
enum FunctionNumber : std::uint32_t {
  kWorldTick = 1,
  kWorldTickRate = 2,
  kWorldRandom = 3,
  kWorldLog = 4,
  kWorldSpawn = 5,
  kWorldRay = 10,
  kWorldRayAll = 11,
  kWorldSweep = 12,
  kWorldOverlap = 13,
  kWorldAskRay = 14,
  kWorldAskSweep = 15,
  kWorldAskOverlap = 16,
  kWorldExplode = 20,
  kWorldPublish = 66,
  kBodyIsHere = 32,
  kBodyIsOwn = 33,
  kBodyKind = 34,
  kBodyPosition = 35,
  kBodyRotation = 36,
  kBodyVelocity = 37,
  kBodySpin = 38,
  kBodyMass = 39,
  kBodyPlayer = 40,
  kBodyGet = 41,
  kBodySet = 42,
  kBodyImpulse = 43,
  kBodySetVelocity = 44,
  kBodyAfter = 45,
  kBodyCancel = 46,
  kBodyRemove = 47,
  kBodyExpireAfter = 48,
  kBodyMember = 49,
  kBodyConnect = 178,
  kBodyDisconnect = 179,
  kBodyIsConnected = 180,
  kBodyController = 182,
  kPlayerControl = 210,
  kPlayerControlled = 211,
  kPlayerSetLimits = 212
};

enum CallbackNumber : std::uint32_t {
  kOnTick = 1,
  kOnControl = 18,
  kOnBodyTick = 32,
  kOnBodyContact = 33,
  kOnBodyContactEnded = 34,
  kOnBodyEntered = 35,
  kOnBodyLeft = 36,
  kOnBodyTimer = 37,
  kOnBodyBlast = 48
};

// Why the host refused a function, or that the callback's work is used up.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct Vector {
  double x = 0, y = 0, z = 0;
  friend constexpr Vector operator+(Vector a, Vector b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  friend constexpr Vector operator-(Vector a, Vector b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  friend constexpr Vector operator*(Vector a, double factor) { return {a.x * factor, a.y * factor, a.z * factor}; }
};

struct Rotation {  // a unit quaternion
  double x = 0, y = 0, z = 0, w = 1;
};

// The number of a body; no reference to a state.
struct BodyId {
  std::uint64_t value = 0;
};
struct PlayerId {
  std::uint64_t value = 0;
};

// A value on its way to the host. It does not own its text, which has to live until the function returns.
class Value : public tessera_game_value {
 public:
  // NOLINTBEGIN(google-explicit-constructor): so that a call reads `body.set("score", 3)`.
  Value() : tessera_game_value{} {}
  Value(const tessera_game_value& value) : tessera_game_value(value) {}
  Value(bool flag) : Value() { type = TESSERA_GAME_FLAG, as.whole = flag ? 1 : 0; }
  Value(int whole) : Value(std::int64_t{whole}) {}
  Value(std::int64_t whole) : Value() { type = TESSERA_GAME_WHOLE, as.whole = whole; }
  Value(double real) : Value() { type = TESSERA_GAME_REAL, as.real = real; }
  Value(std::string_view text) : Value() {
    type = TESSERA_GAME_TEXT, count = static_cast<std::uint32_t>(text.size()), as.text = text.data();
  }
  Value(const std::string& text) : Value(std::string_view(text)) {}
  Value(const char* text) : Value(std::string_view(text)) {}
  Value(Vector v) : Value() { type = TESSERA_GAME_VECTOR, as.vector[0] = v.x, as.vector[1] = v.y, as.vector[2] = v.z; }
  Value(Rotation q) : Value() {
    type = TESSERA_GAME_ROTATION;
    as.rotation[0] = q.x, as.rotation[1] = q.y, as.rotation[2] = q.z, as.rotation[3] = q.w;
  }
  Value(BodyId body) : Value() { type = TESSERA_GAME_BODY, as.id = body.value; }
  Value(PlayerId player) : Value() { type = TESSERA_GAME_PLAYER, as.id = player.value; }

  // NOLINTEND(google-explicit-constructor)

  // The value that the host returned; each throws an Error if it is of another type.
  bool flag() const { return Of(TESSERA_GAME_FLAG).as.whole != 0; }
  std::int64_t whole() const { return Of(TESSERA_GAME_WHOLE).as.whole; }
  double real() const {
    return type == TESSERA_GAME_WHOLE ? static_cast<double>(as.whole) : Of(TESSERA_GAME_REAL).as.real;
  }
  std::string text() const { return {Of(TESSERA_GAME_TEXT).as.text, count}; }
  Vector vector() const {
    const double* v = Of(TESSERA_GAME_VECTOR).as.vector;
    return {v[0], v[1], v[2]};
  }
  Rotation rotation() const {
    const double* q = Of(TESSERA_GAME_ROTATION).as.rotation;
    return {q[0], q[1], q[2], q[3]};
  }
  BodyId body() const { return {Of(TESSERA_GAME_BODY).as.id}; }
  PlayerId player() const { return {Of(TESSERA_GAME_PLAYER).as.id}; }
  bool nothing() const { return type == TESSERA_GAME_NOTHING; }

 private:
  const Value& Of(std::uint32_t wanted) const {
    if (type != wanted) throw Error("a value is of another type than was asked for");
    return *this;
  }
};

// Named values: options of a function, what a timer keeps.
class Values {
 public:
  Values() = default;
  Values(std::initializer_list<std::pair<std::string_view, Value>> named) {
    for (const auto& [name, value] : named) add(name, value);
  }
  explicit Values(const tessera_game_value& value) {
    if (value.type == TESSERA_GAME_FIELDS) fields_.assign(value.as.fields, value.as.fields + value.count);
  }
  // The name has to live as long as this.
  void add(std::string_view name, const Value& value) {
    const auto before = [](const tessera_game_field& field, std::string_view wanted) {
      return std::string_view(field.name, field.name_bytes) < wanted;
    };
    const auto at = std::lower_bound(fields_.begin(), fields_.end(), name, before);
    fields_.insert(at, tessera_game_field{name.data(), name.size(), value});
  }
  // Nothing where there is none of this name.
  Value operator[](std::string_view name) const {
    for (const tessera_game_field& field : fields_) {
      if (std::string_view(field.name, field.name_bytes) == name) return field.value;
    }
    return {};
  }
  Value value() const {
    Value value;
    value.type = TESSERA_GAME_FIELDS;
    value.count = static_cast<std::uint32_t>(fields_.size());
    value.as.fields = fields_.data();
    return value;
  }
  bool empty() const { return fields_.empty(); }

 private:
  std::vector<tessera_game_field> fields_;  // names ascend
};

class Body;

// The world within one callback.
class World {
 public:
  World(const tessera_game_host& host, tessera_game_call* call) : host_(host), call_(call) {}
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  // Any function of the table. The result is valid until the next one.
  Value call(std::uint32_t function, std::initializer_list<Value> arguments) {
    charge(kWorkOfACall);
    // A Value is a tessera_game_value and nothing else.
    static_assert(sizeof(Value) == sizeof(tessera_game_value), "");
    tessera_game_value result{};
    const auto count = static_cast<std::uint32_t>(arguments.size());
    if (host_.call(call_, function, arguments.begin(), count, &result) != 0) throw Error(host_.error(call_));
    return result;
  }
  // Counts work of the game's own.
  void charge(std::uint64_t instructions) {
    if (host_.charge(call_, instructions) != 0) throw Error("too much work");
  }

  std::int64_t tick() { return call(kWorldTick, {}).whole(); }
  double tick_rate() { return call(kWorldTickRate, {}).real(); }
  double random() { return call(kWorldRandom, {}).real(); }
  void log(std::string_view line) { call(kWorldLog, {line}); }
  // Gives the game's backend an event.
  void publish(std::string_view name, const Values& values = {}) { call(kWorldPublish, {name, values.value()}); }
  // `at`, `radius`, `impulse` and so on, as docs/games.md has them.
  void explode(const Values& blast) { call(kWorldExplode, {blast.value()}); }
  Body spawn(std::string_view prefab, Vector position, const Values& options = {});
  // Nothing, or the fields `body`, `point`, `normal`, `fraction` and `distance`; valid until the next function.
  Values ray(Vector from, Vector to, const Values& options = {}) {
    return Values(call(kWorldRay, {from, to, options.value()}));
  }
  Body body(BodyId id);

 private:
  const tessera_game_host& host_;
  tessera_game_call* call_;
};

// A body by its number: nothing of its state is here.
class Body {
 public:
  Body(World& world, BodyId id) : world_(&world), id_(id) {}
  BodyId id() const { return id_; }
  friend bool operator==(const Body& a, const Body& b) { return a.id_.value == b.id_.value; }
  friend bool operator!=(const Body& a, const Body& b) { return !(a == b); }

  bool is_here() const { return Get(kBodyIsHere).flag(); }
  bool is_own() const { return Get(kBodyIsOwn).flag(); }
  std::string kind() const { return Get(kBodyKind).text(); }
  Vector position() const { return Get(kBodyPosition).vector(); }
  Rotation rotation() const { return Get(kBodyRotation).rotation(); }
  Vector velocity() const { return Get(kBodyVelocity).vector(); }
  Vector spin() const { return Get(kBodySpin).vector(); }
  double mass() const { return Get(kBodyMass).real(); }
  std::optional<PlayerId> player() const {
    const Value player = Get(kBodyPlayer);
    return player.nothing() ? std::nullopt : std::optional(player.player());
  }

  // Properties, by type.
  bool flag(std::string_view property) const { return world_->call(kBodyGet, {id_, property}).flag(); }
  std::int64_t whole(std::string_view property) const { return world_->call(kBodyGet, {id_, property}).whole(); }
  double real(std::string_view property) const { return world_->call(kBodyGet, {id_, property}).real(); }
  std::string text(std::string_view property) const { return world_->call(kBodyGet, {id_, property}).text(); }
  void set(std::string_view property, const Value& value) { world_->call(kBodySet, {id_, property, value}); }

  void impulse(Vector impulse_ns) { world_->call(kBodyImpulse, {id_, impulse_ns}); }
  void impulse(Vector impulse_ns, Vector point) { world_->call(kBodyImpulse, {id_, impulse_ns, point}); }
  void set_velocity(Vector velocity) { world_->call(kBodySetVelocity, {id_, velocity}); }
  // The number of the timer.
  std::int64_t after(std::int64_t ticks, std::string_view name, const Values& values = {}) {
    return world_->call(kBodyAfter, {id_, ticks, name, values.value()}).whole();
  }
  bool cancel(std::int64_t timer) { return world_->call(kBodyCancel, {id_, timer}).flag(); }
  void remove() { world_->call(kBodyRemove, {id_}); }
  void expire_after(std::int64_t ticks) { world_->call(kBodyExpireAfter, {id_, ticks}); }
  // `kind`, `at` and so on, as docs/games.md has them.
  void connect(const Body& other, const Values& joint = {}) {
    world_->call(kBodyConnect, {id_, other.id_, joint.value()});
  }
  void disconnect(const Body& other) { world_->call(kBodyDisconnect, {id_, other.id_}); }
  bool is_connected(const Body& other) const { return world_->call(kBodyIsConnected, {id_, other.id_}).flag(); }
  std::optional<Body> member(std::int64_t number) const {
    const Value body = world_->call(kBodyMember, {id_, number});
    return body.nothing() ? std::nullopt : std::optional(Body(*world_, body.body()));
  }

 private:
  Value Get(std::uint32_t function) const { return world_->call(function, {id_}); }

  World* world_;
  BodyId id_;
};

inline Body World::spawn(std::string_view prefab, Vector position, const Values& options) {
  return Body(*this, call(kWorldSpawn, {prefab, position, options.value()}).body());
}
inline Body World::body(BodyId id) { return Body(*this, id); }

using WorldCallback = std::function<void(World&)>;
using BodyCallback = std::function<void(World&, Body self)>;
using PairCallback = std::function<void(World&, Body self, Body other)>;
using TimerCallback = std::function<void(World&, Body self, const std::string& name, const Values& values)>;
// Any callback of the table, by its number, with its arguments as the interface has them.
using AnyCallback = std::function<void(World&, const tessera_game_callback&)>;

// The callbacks of bodies of one kind.
class Kind {
 public:
  Kind& on_tick(BodyCallback act) { return OnBody(kOnBodyTick, std::move(act)); }
  Kind& on_contact(PairCallback act) { return OnPair(kOnBodyContact, std::move(act)); }
  Kind& on_contact_ended(PairCallback act) { return OnPair(kOnBodyContactEnded, std::move(act)); }
  Kind& on_entered(PairCallback act) { return OnPair(kOnBodyEntered, std::move(act)); }
  Kind& on_left(PairCallback act) { return OnPair(kOnBodyLeft, std::move(act)); }
  Kind& on_timer(TimerCallback act) {
    return on(kOnBodyTimer, [act = std::move(act)](World& world, const tessera_game_callback& event) {
      act(world, Self(world, event), Value(event.arguments[1]).text(), Values(event.arguments[2]));
    });
  }
  Kind& on(std::uint32_t callback, AnyCallback act) {
    callbacks_[callback] = std::move(act);
    return *this;
  }
  // nullptr: there is none.
  const AnyCallback* find(std::uint32_t callback) const {
    const auto found = callbacks_.find(callback);
    return found == callbacks_.end() ? nullptr : &found->second;
  }

 private:
  static Body Self(World& world, const tessera_game_callback& event) {
    return Body(world, Value(event.arguments[0]).body());
  }
  Kind& OnBody(std::uint32_t callback, BodyCallback act) {
    return on(callback, [act = std::move(act)](World& world, const tessera_game_callback& event) {
      act(world, Self(world, event));
    });
  }
  Kind& OnPair(std::uint32_t callback, PairCallback act) {
    return on(callback, [act = std::move(act)](World& world, const tessera_game_callback& event) {
      act(world, Self(world, event), Body(world, Value(event.arguments[1]).body()));
    });
  }

  std::map<std::uint32_t, AnyCallback> callbacks_;
};

// Which callbacks a game has.
class Game {
 public:
  Game& on_tick(WorldCallback act) {
    world_.on(kOnTick, [act = std::move(act)](World& world, const tessera_game_callback&) { act(world); });
    return *this;
  }
  // Callbacks of the world by their numbers.
  Game& on(std::uint32_t callback, AnyCallback act) {
    world_.on(callback, std::move(act));
    return *this;
  }
  // The bodies to which the scene gives this kind.
  Kind& kind(const std::string& name) { return kinds_[name]; }
  // nullptr: there is none.
  const AnyCallback* find(std::uint32_t callback, const char* kind) const {
    if (kind == nullptr) return world_.find(callback);
    const auto found = kinds_.find(std::string_view(kind));
    return found == kinds_.end() ? nullptr : found->second.find(callback);
  }

 private:
  Kind world_;
  std::map<std::string, Kind, std::less<>> kinds_;
};

// --- From exceptions to the C interface

namespace internal {

struct Loaded {
  const tessera_game_host* host;
  Game game;
};

inline void Write(tessera_game_error* error, const char* text) {
  std::snprintf(error->text, sizeof error->text, "%s", text);
}

// Runs `act`; returns 0, or 1 and why not.
template <class Act>
int Guarded(tessera_game_error* error, const Act& act) {
  try {
    act();
    return 0;
  } catch (const std::exception& exception) {
    Write(error, exception.what());
  } catch (...) {
    Write(error, "an exception that is no std::exception");
  }
  return 1;
}

template <void (*kDeclare)(Game&)>
int Load(const tessera_game_host* host, const tessera_game_source*, void** game, tessera_game_error* error) {
  return Guarded(error, [&] {
    auto loaded = std::make_unique<Loaded>(Loaded{host, {}});
    kDeclare(loaded->game);
    *game = loaded.release();
  });
}

inline void Unload(void* game) { delete static_cast<Loaded*>(game); }

inline int Handles(const void* game, std::uint32_t callback, const char* kind) {
  return static_cast<const Loaded*>(game)->game.find(callback, kind) != nullptr ? 1 : 0;
}

inline int Run(void* game, tessera_game_call* call, const tessera_game_callback* event, tessera_game_error* error) {
  return Guarded(error, [&] {
    const Loaded& loaded = *static_cast<const Loaded*>(game);
    const AnyCallback* const callback = loaded.game.find(event->callback, event->kind);
    if (callback == nullptr) throw Error("the game has no such callback");
    World world(*loaded.host, call);
    (*callback)(world, *event);
  });
}

}  // namespace internal
}  // namespace tessera::native

// NOLINTBEGIN(bugprone-macro-parentheses): `game` is declared here.
// Begins the block that says which callbacks the game has; `game` is a tessera::native::Game&. Once in a library.
#define TESSERA_GAME_MODULE(game) TESSERA_MOVING_GAME_MODULE(game, nullptr)
// The same of a game that moves players' bodies itself: `movement` is a const tessera_movement* (tessera/movement.h).
#define TESSERA_MOVING_GAME_MODULE(game, movement)                                                       \
  static void TesseraDeclareGame(::tessera::native::Game& game);                                         \
  extern "C" __attribute__((visibility("default"))) const tessera_game_module* tessera_game_module_1() { \
    static const tessera_game_module module = {sizeof module,                                            \
                                               TESSERA_GAME_ABI,                                         \
                                               ::tessera::native::internal::Load<TesseraDeclareGame>,    \
                                               ::tessera::native::internal::Unload,                      \
                                               ::tessera::native::internal::Handles,                     \
                                               ::tessera::native::internal::Run,                         \
                                               movement};                                                \
    return &module;                                                                                      \
  }                                                                                                      \
  static void TesseraDeclareGame(::tessera::native::Game& game)
// NOLINTEND(bugprone-macro-parentheses)

#endif
