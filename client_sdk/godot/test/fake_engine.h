// FakeEngine: the part of Godot that the plug-in sees, so that its code runs without the engine: values and objects,
// classes with the methods that the plug-in may call, the tree of nodes, signals, frames.
//
// It is stricter than the engine: a method that a class does not have, an argument of another type, and a signal that
// was not registered with these arguments fail the test. It counts values and objects, so a leak fails it too. Methods
// are as the engine's documents state them; whether they are so the engine alone can say.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "client_sdk/godot/abi.h"
#include "client_sdk/godot/test/fake_values.h"

namespace godot_plugin {

struct FakeSignal {
  std::string name;
  std::vector<FakeValue> arguments;
};

struct FakeObject {
  std::uint64_t id = 0;
  std::string class_name;
  void* instance = nullptr;  // the plug-in's, of its class
  int references = 0;        // where its class counts them
  std::uint64_t parent = 0;
  std::vector<std::uint64_t> children;
  std::map<std::string, std::vector<FakeValue>> last_call;  // by the method's name
  std::map<std::string, int> calls;
  std::vector<FakeSignal> signals;
};

class FakeEngine {
 public:
  struct Described {
    std::string name;
    abi::Type type = abi::kNil;
    std::string hint, class_name;
  };
  struct Method {
    std::vector<Described> arguments;
    bool has_result = false;
    Described result;
    void* userdata = nullptr;
    abi::MethodCall call = nullptr;
    abi::MethodTypedCall typed_call = nullptr;
  };
  struct Property {
    Described described;
    std::string setter, getter;
  };

  // One at a time: the plug-in's functions have no argument that says which.
  FakeEngine();
  ~FakeEngine();
  static FakeEngine* Current();
  static abi::AnyFunction Get(const char* name);

  // Loads the plug-in and registers its class; false where it refuses the engine.
  bool Load();
  void Unload();

  // A node of the plug-in's class, in the tree, whose _ready has come.
  std::uint64_t AddWorldNode(const std::map<std::string, FakeValue>& properties);
  // Notifies nodes that process, then frees those that are to be freed.
  void Frame();
  void Destroy(std::uint64_t id);

  FakeObject* Find(std::uint64_t id);
  std::vector<FakeObject*> OfClass(const std::string& name);
  // Both ways in which the engine calls a method; the results are compared.
  FakeValue Call(std::uint64_t id, const std::string& method, const std::vector<FakeValue>& arguments);
  abi::CallError TryCall(std::uint64_t id, const std::string& method, const std::vector<FakeValue>& arguments,
                         FakeValue* result);
  FakeValue CallTyped(std::uint64_t id, const std::string& method, const std::vector<FakeValue>& arguments);
  void SetProperty(std::uint64_t id, const std::string& name, const FakeValue& value);
  FakeValue GetProperty(std::uint64_t id, const std::string& name);

  // Called with each signal of the plug-in's nodes, while it is emitted.
  std::function<void(const FakeSignal&)> on_signal;
  bool editor_hint = false;
  std::string lacks;                // a function that this engine has not
  std::vector<std::string> errors;  // in its log
  std::map<std::string, Method> methods;
  std::map<std::string, Property> properties;
  std::map<std::string, std::vector<Described>> signals;
  bool class_registered = false;
  // Values that were made and not destroyed.
  int live_values = 0;

  FakeValue CallObject(FakeObject& object, const std::string& method, const std::vector<FakeValue>& arguments,
                       abi::CallError& error);
  FakeObject& Make(const std::string& class_name);
  void Release(std::uint64_t id);
  abi::ClassInfo class_info{};

 private:
  abi::Initialization initialization_{};
  std::map<std::uint64_t, std::unique_ptr<FakeObject>> objects_;
  std::vector<std::uint64_t> to_free_;
  std::uint64_t last_id_ = 100;
};

}  // namespace godot_plugin
