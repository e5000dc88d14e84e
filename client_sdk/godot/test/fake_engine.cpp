#include "client_sdk/godot/test/fake_engine.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <utility>

#include "client_sdk/godot/test/fake_classes.h"
#include "client_sdk/godot/test/fake_values.h"

extern "C" std::uint8_t tessera_godot_init(godot_plugin::abi::GetFunction get, void* library,
                                           godot_plugin::abi::Initialization* initialization);

namespace godot_plugin {
namespace {

using abi::Type;

FakeEngine* current = nullptr;

std::vector<FakeValue> ListOf(const void* const* arguments, std::int64_t count) {
  std::vector<FakeValue> list;
  for (std::int64_t i = 0; i < count; ++i) list.push_back(In(arguments[i]));
  return list;
}

void CallVariant(void* self, const void* method, const void* const* arguments, std::int64_t count, void* result,
                 abi::CallError* error) {
  *error = {};
  const std::string& name = Pointed(method).text;
  const std::vector<FakeValue> list = ListOf(arguments, count);
  const FakeValue before = In(self);
  if (before.type == abi::kObject) {
    FakeObject* object = current->Find(before.object);
    EXPECT_NE(object, nullptr) << name << " of an object that is gone";
    Put(result, object == nullptr ? FakeValue() : current->CallObject(*object, name, list, *error));
    return;
  }
  FakeValue gives;

  const bool packed = before.type > abi::kArray;
  if (name == "resize" && count == 1 && before.type == abi::kArray) {
    Inside(self).array.resize(static_cast<std::size_t>(list[0].integer));
  } else if (name == "resize" && count == 1 && packed) {
    Inside(self).packed.resize(static_cast<std::size_t>(list[0].integer) * ElementBytes(before.type));
  } else if (name == "size" && count == 0 && packed) {
    gives = FakeValue::Int(static_cast<std::int64_t>(before.packed.size() / ElementBytes(before.type)));
  } else {
    ADD_FAILURE() << name << " of a value of type " << before.type;
    error->kind = abi::kInvalidMethod;
  }
  Put(result, gives);
}

FakeEngine::Described DescriptionOf(const abi::PropertyInfo& info) {
  return {Pointed(info.name).text, static_cast<Type>(info.type), Pointed(info.hint_string).text,
          Pointed(info.class_name).text};
}

void ConstructVariant(Type type, void* to, const void* const*, std::int32_t count, abi::CallError* error) {
  EXPECT_EQ(count, 0);
  *error = {};
  FakeValue value;
  value.type = type;
  Put(to, value);
}

void SetIndexed(void* self, std::int64_t index, const void* value, std::uint8_t* valid, std::uint8_t* beyond) {
  FakeValue& array = Inside(self);
  const auto at = static_cast<std::size_t>(index);
  *valid = array.type == abi::kArray ? 1 : 0;
  *beyond = at >= array.array.size() ? 1 : 0;
  ASSERT_EQ(*beyond, 0);
  array.array[at] = In(value);
}

void SetKeyed(void* self, const void* key, const void* value, std::uint8_t* valid) {
  FakeValue& whole = Inside(self);
  *valid = whole.type == abi::kDictionary ? 1 : 0;
  ASSERT_EQ(*valid, 1);
  whole.dictionary[In(key).text] = In(value);
}

std::int64_t ReadString(const void* string, char* text, std::int64_t capacity) {
  const std::string& all = Pointed(string).text;
  const std::size_t count = std::min(all.size(), static_cast<std::size_t>(capacity));
  if (text != nullptr) std::memcpy(text, all.data(), count);
  return static_cast<std::int64_t>(all.size());
}

template <class Element>
Element* ElementAt(void* array, std::int64_t index) {
  std::vector<std::uint8_t>& bytes = Pointer(array)->packed;
  EXPECT_LT(static_cast<std::size_t>(index), bytes.size());
  return reinterpret_cast<Element*>(bytes.data()) + index;
}

void* Singleton(const void* name) {
  const std::vector<FakeObject*> found = current->OfClass(Pointed(name).text);
  return found.empty() ? nullptr : found[0];
}

void RegisterClass(void*, const void* name, const void* parent, const abi::ClassInfo* info) {
  EXPECT_EQ(Pointed(name).text, "TesseraWorld");
  EXPECT_EQ(Pointed(parent).text, "Node3D");
  current->class_info = *info;
  current->class_registered = true;
}

void RegisterMethod(void*, const void*, const abi::MethodInfo* info) {
  FakeEngine::Method method;
  for (std::uint32_t i = 0; i < info->argument_count; ++i)
    method.arguments.push_back(DescriptionOf(info->arguments[i]));
  method.has_result = info->has_result != 0;
  if (method.has_result) method.result = DescriptionOf(*info->result);
  method.userdata = info->userdata;
  method.call = info->call;
  method.typed_call = info->typed_call;
  EXPECT_TRUE(current->methods.emplace(Pointed(info->name).text, method).second) << Pointed(info->name).text;
}

void RegisterProperty(void*, const void*, const abi::PropertyInfo* info, const void* setter, const void* getter) {
  const FakeEngine::Described described = DescriptionOf(*info);
  current->properties[described.name] = {described, Pointed(setter).text, Pointed(getter).text};
}

void RegisterSignal(void*, const void*, const void* signal, const abi::PropertyInfo* arguments, std::int64_t count) {
  std::vector<FakeEngine::Described>& list = current->signals[Pointed(signal).text];
  for (std::int64_t i = 0; i < count; ++i) list.push_back(DescriptionOf(arguments[i]));
}

// The engine's functions by our member's name.
struct Functions {
  abi::print_error_function print_error = [](const char*, const char* message, const char*, const char*, std::int32_t,
                                             std::uint8_t) { current->errors.emplace_back(message); };
  abi::variant_copy_function variant_copy = [](void* to, const void* from) { Put(to, In(from)); };
  abi::variant_nil_function variant_nil = [](void* to) { Put(to, {}); };
  abi::variant_destroy_function variant_destroy = DestroyVariant;
  abi::variant_call_function variant_call = CallVariant;
  abi::variant_construct_function variant_construct = ConstructVariant;
  abi::variant_type_function variant_type = [](const void* variant) { return In(variant).type; };
  abi::variant_set_keyed_function variant_set_keyed = SetKeyed;
  abi::variant_set_indexed_function variant_set_indexed = SetIndexed;
  abi::from_type_function from_type = FromTypeFunction;
  abi::to_type_function to_type = ToTypeFunction;
  abi::destructor_function destructor = [](Type type) -> abi::Destroy {
    return IsPointer(type) ? DestroyTyped : nullptr;
  };
  abi::string_new_function string_new = [](void* to, const char* text, std::int64_t bytes) {
    PutTyped(abi::kString, to, FakeValue::Text(std::string(text, static_cast<std::size_t>(bytes))));
  };
  abi::string_read_function string_read = ReadString;
  abi::name_new_function name_new = [](void* to, const char* text) {
    PutTyped(abi::kStringName, to, FakeValue::Text(text));
  };
  abi::bytes_at_function bytes_at = [](const void* array, std::int64_t index) -> const std::uint8_t* {
    return Pointed(array).packed.data() + index;
  };
  abi::bytes_at_to_write_function bytes_at_to_write = ElementAt<std::uint8_t>;
  abi::floats_at_function floats_at = ElementAt<float>;
  abi::vectors_at_function vectors_at = [](void* array, std::int64_t index) -> void* {
    return ElementAt<std::array<float, 3>>(array, index);
  };
  abi::singleton_function singleton = Singleton;
  abi::construct_object_function construct_object = [](const void* name) -> void* {
    return &current->Make(Pointed(name).text);
  };
  abi::object_set_instance_function object_set_instance = [](void* object, const void* name, void* instance) {
    static_cast<FakeObject*>(object)->class_name = Pointed(name).text;
    static_cast<FakeObject*>(object)->instance = instance;
  };
  abi::object_id_function object_id = [](const void* object) { return static_cast<const FakeObject*>(object)->id; };
  abi::object_of_id_function object_of_id = [](std::uint64_t id) -> void* { return current->Find(id); };
  abi::register_class_function register_class = RegisterClass;
  abi::register_method_function register_method = RegisterMethod;
  abi::register_property_function register_property = RegisterProperty;
  abi::register_signal_function register_signal = RegisterSignal;
  abi::unregister_class_function unregister_class = [](void*, const void*) { current->class_registered = false; };
};

}  // namespace

FakeEngine* FakeEngine::Current() { return current; }

FakeEngine::FakeEngine() {
  current = this;
  Make("Engine");
  Make("ProjectSettings");
}

FakeEngine::~FakeEngine() { current = nullptr; }

abi::AnyFunction FakeEngine::Get(const char* name) {
  static const Functions functions;
  if (current->lacks == name) return nullptr;
#define TESSERA_GODOT_GIVE(member, engine_name, type, ours) \
  if (std::string(name) == #engine_name) return reinterpret_cast<abi::AnyFunction>(functions.member);
  TESSERA_GODOT_FUNCTIONS(TESSERA_GODOT_GIVE)
#undef TESSERA_GODOT_GIVE
  return nullptr;
}

bool FakeEngine::Load() {
  if (tessera_godot_init(Get, this, &initialization_) == 0) return false;
  EXPECT_LE(initialization_.minimum_level, abi::kSceneLevel);
  for (const std::int32_t level : {0, 1, 2, 3}) initialization_.initialize(initialization_.userdata, level);
  return class_registered;
}

void FakeEngine::Unload() {
  for (const std::int32_t level : {3, 2, 1, 0}) initialization_.deinitialize(initialization_.userdata, level);
}

FakeObject& FakeEngine::Make(const std::string& class_name) {
  EXPECT_TRUE(IsKnownClass(class_name)) << class_name;
  auto object = std::make_unique<FakeObject>();
  object->id = ++last_id_;
  object->class_name = class_name;
  return *(objects_[object->id] = std::move(object));
}

FakeObject* FakeEngine::Find(std::uint64_t id) {
  const auto at = objects_.find(id);
  return at == objects_.end() ? nullptr : at->second.get();
}

std::vector<FakeObject*> FakeEngine::OfClass(const std::string& name) {
  std::vector<FakeObject*> found;
  for (const auto& [id, object] : objects_) {
    if (object->class_name == name) found.push_back(object.get());
  }
  return found;
}

// A value that held an object is gone.
void FakeEngine::Release(std::uint64_t id) {
  FakeObject* object = Find(id);
  if (object == nullptr || !IsA(object->class_name, "RefCounted")) return;
  if (--object->references == 0) Destroy(id);
}

void FakeEngine::Destroy(std::uint64_t id) {
  FakeObject* object = Find(id);
  if (object == nullptr) return;
  for (const std::uint64_t child : std::vector<std::uint64_t>(object->children)) Destroy(child);
  if (FakeObject* parent = Find(object->parent); parent != nullptr) {
    parent->children.erase(std::find(parent->children.begin(), parent->children.end(), id));
  }
  if (object->instance != nullptr) class_info.free(class_info.userdata, object->instance);
  objects_.erase(id);
}

FakeValue FakeEngine::CallObject(FakeObject& object, const std::string& method, const std::vector<FakeValue>& arguments,
                                 abi::CallError& error) {
  ++object.calls[method];
  if (method == "emit_signal" && object.instance != nullptr) {
    const std::string name = arguments.at(0).text;
    const auto known = signals.find(name);
    EXPECT_NE(known, signals.end()) << name;
    const FakeSignal signal{name, {arguments.begin() + 1, arguments.end()}};
    if (known != signals.end()) {
      EXPECT_EQ(signal.arguments.size(), known->second.size()) << name;
      for (std::size_t i = 0; i < std::min(signal.arguments.size(), known->second.size()); ++i) {
        EXPECT_EQ(signal.arguments[i].type, known->second[i].type) << name << " " << known->second[i].name;
      }
    }
    object.signals.push_back(signal);
    if (on_signal) on_signal(signal);
    return {};
  }
  const KnownMethod* known = FindMethod(object.class_name, method);
  if (known == nullptr || known->arguments.size() != arguments.size()) {
    ADD_FAILURE() << object.class_name << " has no method " << method << " of " << arguments.size();
    error.kind = abi::kInvalidMethod;
    return {};
  }
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    EXPECT_EQ(arguments[i].type, known->arguments[i]) << method << ", argument " << i;
  }
  if (!known->of_class.empty()) {
    const FakeObject* given = Find(arguments.at(0).object);
    EXPECT_TRUE(given != nullptr && IsA(given->class_name, known->of_class)) << method;
  }
  object.last_call[method] = arguments;
  if (method == "is_editor_hint") return FakeValue::Bool(editor_hint);
  if (method == "globalize_path") return arguments[0];
  if (method == "queue_free") to_free_.push_back(object.id);
  if (method == "add_child") {
    FakeObject& child = *Find(arguments[0].object);
    EXPECT_EQ(child.parent, 0U) << "it has a parent already";
    child.parent = object.id;
    object.children.push_back(child.id);
  }
  return {};
}

std::uint64_t FakeEngine::AddWorldNode(const std::map<std::string, FakeValue>& given) {
  auto* object = static_cast<FakeObject*>(class_info.create(class_info.userdata));
  for (const auto& [name, value] : given) SetProperty(object->id, name, value);
  class_info.notification(object->instance, abi::kNotificationReady, 0);
  return object->id;
}

void FakeEngine::Frame() {
  for (FakeObject* object : OfClass("TesseraWorld")) {
    const auto process = object->last_call.find("set_process");
    if (process == object->last_call.end() || process->second[0].integer == 0) continue;
    class_info.notification(object->instance, abi::kNotificationProcess, 0);
  }
  for (const std::uint64_t id : std::exchange(to_free_, {})) Destroy(id);
}

abi::CallError FakeEngine::TryCall(std::uint64_t id, const std::string& method, const std::vector<FakeValue>& arguments,
                                   FakeValue* result) {
  const Method& found = methods.at(method);
  std::vector<Memory> memory(arguments.size() + 1);
  std::vector<const void*> list;
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    Put(memory[i].bytes.data(), arguments[i]);
    list.push_back(memory[i].bytes.data());
  }
  void* gives = memory.back().bytes.data();
  Put(gives, {});
  abi::CallError error{};
  found.call(found.userdata, Find(id)->instance, list.data(), static_cast<std::int64_t>(list.size()), gives, &error);
  if (result != nullptr) *result = In(gives);
  for (Memory& one : memory) DestroyVariant(one.bytes.data());
  return error;
}

FakeValue FakeEngine::CallTyped(std::uint64_t id, const std::string& method, const std::vector<FakeValue>& arguments) {
  const Method& found = methods.at(method);
  EXPECT_EQ(arguments.size(), found.arguments.size()) << method;
  std::vector<Memory> memory(arguments.size());
  std::vector<const void*> list;
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    PutTyped(found.arguments[i].type, memory[i].bytes.data(), arguments[i]);
    list.push_back(memory[i].bytes.data());
  }
  Memory gives;
  const Type type = found.has_result ? found.result.type : abi::kNil;
  if (type == abi::kNil) Put(gives.bytes.data(), {});
  found.typed_call(found.userdata, Find(id)->instance, list.data(), gives.bytes.data());
  const FakeValue result = type == abi::kNil ? In(gives.bytes.data()) : TypedIn(type, gives.bytes.data());
  if (type == abi::kNil) DestroyVariant(gives.bytes.data());
  if (IsPointer(type)) DestroyTyped(gives.bytes.data());
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    if (IsPointer(found.arguments[i].type)) DestroyTyped(memory[i].bytes.data());
  }
  return result;
}

FakeValue FakeEngine::Call(std::uint64_t id, const std::string& method, const std::vector<FakeValue>& arguments) {
  FakeValue result;
  EXPECT_EQ(TryCall(id, method, arguments, &result).kind, abi::kCallOk) << method;
  return result;
}

void FakeEngine::SetProperty(std::uint64_t id, const std::string& name, const FakeValue& value) {
  Call(id, properties.at(name).setter, {value});
}

FakeValue FakeEngine::GetProperty(std::uint64_t id, const std::string& name) {
  return Call(id, properties.at(name).getter, {});
}

}  // namespace godot_plugin