// WorldNode: the node TesseraWorld, which joins a world, draws its bodies and says what happens in it.
//
// It joins when it is ready, if it has a grant, a grant's file or an address, and polls with each frame while it is in
// the tree. Its methods, properties and signals are in registration.cpp, as a script sees them.
//
// Promises: nothing it does waits but leave, and joining by an address, which is for development. What goes wrong is in
// the signal left, in the engine's log, and in get_last_error. In the editor it does nothing.
// Thread rule: the engine's main thread.
#pragma once

#include <tessera/tessera.h>
#include <array>

#include <string>
#include <vector>

#include "bodies.h"
#include "engine.h"

namespace godot_plugin {

class WorldNode {
 public:
  // `object` is the engine's node, which owns this.
  explicit WorldNode(void* object) : object_(object), bodies_(object) {}
  ~WorldNode() { tessera_close(client_); }
  WorldNode(const WorldNode&) = delete;
  WorldNode& operator=(const WorldNode&) = delete;

  void Notify(std::int32_t what);

  // Properties; each counts from the next join.
  std::vector<std::uint8_t> grant;
  std::string grant_file;                      // res://, user:// or a path
  std::string address, instance, player_name;  // through libtessera-connect
  std::string scene_cache_folder;              // empty: scenes are kept nowhere
  Drawing drawing = Drawing::kNodes;
  bool predict = true;

  // By the properties. The world is TESSERA_JOINING until the signal joined; a code that is not TESSERA_OK comes with
  // the signal left.
  tessera_code Join();
  // Goes on by a newer grant.
  tessera_code Renew(const std::vector<std::uint8_t>& newer);
  // Emits left at once, with an empty reason.
  tessera_code Leave(std::uint32_t deadline_ms);
  tessera_code Send(const void* bytes, std::size_t size);
  void Push(const std::array<double, 3>& force, const std::array<double, 3>& torque);
  void Steer(const tessera_steering& steering);

  tessera_state state() const { return tessera_get_state(client_); }
  std::uint64_t own_body() const { return tessera_own_body(client_); }
  std::uint32_t player() const { return tessera_player(client_); }
  const std::string& last_error() const { return last_error_; }
  Value BodyNode(std::uint64_t id) const;
  // Nil: there is none of that name.
  Value BodyProperty(std::uint64_t id, const std::string& name) const;
  Value WorldProperty(const std::string& name) const;

 private:
  void Frame();
  tessera_code Fail(tessera_code code);
  void Close(const std::string& reason);
  void TellEvents();
  void TellGameEvents();
  void TellChanges(const Bodies::Changes& changes);
  std::string Globalized(const std::string& path) const;
  tessera_code Granted(std::vector<std::uint8_t>& granted);
  template <class... Arguments>
  void Emit(const char* signal, const Arguments&... arguments) {
    Value::Object(object_).Call("emit_signal", Value(Name(signal)), arguments...);
  }

  void* object_;
  tessera_client* client_ = nullptr;
  bool inside_ = false;      // joined was emitted
  std::uint64_t joins_ = 0;  // and ends: a script that a signal reaches may leave, and join again
  std::string last_error_;
  Bodies bodies_;
};

}  // namespace godot_plugin
