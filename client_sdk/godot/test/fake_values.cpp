#include "client_sdk/godot/test/fake_values.h"

#include <cstring>

#include "client_sdk/godot/test/fake_classes.h"
#include "client_sdk/godot/test/fake_engine.h"

namespace godot_plugin {
namespace {

using abi::Type;

// In the engine's memory a value is a type and a pointer; a String, a name or an array is the pointer alone.
struct Boxed {
  std::int64_t type;
  FakeValue* value;
  std::int64_t unused;
};
static_assert(sizeof(Boxed) == abi::kVariantBytes);

FakeValue* NewValue(const FakeValue& value) {
  ++FakeEngine::Current()->live_values;
  if (value.type == abi::kObject && value.object != 0) {
    FakeObject* object = FakeEngine::Current()->Find(value.object);
    if (object != nullptr && IsA(object->class_name, "RefCounted")) ++object->references;
  }
  return new FakeValue(value);
}

void Drop(FakeValue* value) {
  if (value == nullptr) return;
  --FakeEngine::Current()->live_values;
  const std::uint64_t object = value->type == abi::kObject ? value->object : 0;
  delete value;
  if (object != 0) FakeEngine::Current()->Release(object);
}

std::size_t FloatsIn(Type type) { return type == abi::kVector2 ? 2 : type == abi::kVector3 ? 3 : 12; }

template <int kType>
void FromTyped(void* variant, void* from) {
  Put(variant, TypedIn(static_cast<Type>(kType), from));
}
template <int kType>
void ToTyped(void* to, void* variant) {
  PutTyped(static_cast<Type>(kType), to, In(variant));
}

template <template <int> class Of>
abi::Convert Choose(Type type) {
  switch (type) {
    case abi::kBool:
      return Of<abi::kBool>::kFunction;
    case abi::kInt:
      return Of<abi::kInt>::kFunction;
    case abi::kFloat:
      return Of<abi::kFloat>::kFunction;
    case abi::kString:
      return Of<abi::kString>::kFunction;
    case abi::kVector2:
      return Of<abi::kVector2>::kFunction;
    case abi::kVector3:
      return Of<abi::kVector3>::kFunction;
    case abi::kTransform3d:
      return Of<abi::kTransform3d>::kFunction;
    case abi::kStringName:
      return Of<abi::kStringName>::kFunction;
    case abi::kObject:
      return Of<abi::kObject>::kFunction;
    case abi::kPackedBytes:
      return Of<abi::kPackedBytes>::kFunction;
    case abi::kPackedFloats:
      return Of<abi::kPackedFloats>::kFunction;
    case abi::kPackedVectors:
      return Of<abi::kPackedVectors>::kFunction;
    default:
      return nullptr;
  }
}
template <int kType>
struct From {
  static constexpr abi::Convert kFunction = FromTyped<kType>;
};
template <int kType>
struct To {
  static constexpr abi::Convert kFunction = ToTyped<kType>;
};

}  // namespace

void Put(void* variant, const FakeValue& value) {
  auto& boxed = *static_cast<Boxed*>(variant);
  boxed = {value.type, value.type == abi::kNil ? nullptr : NewValue(value), 0};
}

const FakeValue& In(const void* variant) {
  static const FakeValue nil;
  const auto& boxed = *static_cast<const Boxed*>(variant);
  return boxed.value == nullptr ? nil : *boxed.value;
}

void DestroyVariant(void* variant) {
  auto& boxed = *static_cast<Boxed*>(variant);
  Drop(boxed.value);
  boxed = {};
}

FakeValue& Inside(void* variant) { return *static_cast<Boxed*>(variant)->value; }

FakeValue*& Pointer(void* typed) { return *static_cast<FakeValue**>(typed); }

const FakeValue& Pointed(const void* typed) { return **static_cast<FakeValue* const*>(typed); }

bool IsPointer(Type type) { return type == abi::kString || type == abi::kStringName || type >= abi::kDictionary; }

void PutTyped(Type type, void* to, const FakeValue& value) {
  if (IsPointer(type)) {
    FakeValue whole = value;
    whole.type = type;
    Pointer(to) = NewValue(whole);
  } else if (type == abi::kBool) {
    *static_cast<std::uint8_t*>(to) = value.integer != 0 ? 1 : 0;
  } else if (type == abi::kInt) {
    *static_cast<std::int64_t*>(to) = value.type == abi::kFloat ? static_cast<std::int64_t>(value.real) : value.integer;
  } else if (type == abi::kFloat) {
    *static_cast<double*>(to) = value.type == abi::kInt ? static_cast<double>(value.integer) : value.real;
  } else if (type == abi::kObject) {
    *static_cast<FakeObject**>(to) = FakeEngine::Current()->Find(value.object);
  } else {
    std::memcpy(to, value.numbers.data(), FloatsIn(type) * sizeof(float));
  }
}

FakeValue TypedIn(Type type, const void* from) {
  FakeValue value;
  value.type = type;
  if (IsPointer(type)) {
    value = Pointed(from);
    value.type = type;
  } else if (type == abi::kBool) {
    value.integer = *static_cast<const std::uint8_t*>(from);
  } else if (type == abi::kInt) {
    value.integer = *static_cast<const std::int64_t*>(from);
  } else if (type == abi::kFloat) {
    value.real = *static_cast<const double*>(from);
  } else if (type == abi::kObject) {
    const FakeObject* object = *static_cast<FakeObject* const*>(from);
    value.object = object == nullptr ? 0 : object->id;
  } else {
    std::memcpy(value.numbers.data(), from, FloatsIn(type) * sizeof(float));
  }
  return value;
}

void DestroyTyped(void* typed) {
  Drop(Pointer(typed));
  Pointer(typed) = nullptr;
}

abi::Convert FromTypeFunction(Type type) { return Choose<From>(type); }

abi::Convert ToTypeFunction(Type type) { return Choose<To>(type); }

std::size_t ElementBytes(Type type) {
  return type == abi::kPackedBytes ? 1 : type == abi::kPackedFloats ? sizeof(float) : 3 * sizeof(float);
}

FakeValue FakeValue::Int(std::int64_t number) {
  FakeValue value;
  value.type = abi::kInt;
  value.integer = number;
  return value;
}
FakeValue FakeValue::Real(double number) {
  FakeValue value;
  value.type = abi::kFloat;
  value.real = number;
  return value;
}
FakeValue FakeValue::Bool(bool flag) {
  FakeValue value;
  value.type = abi::kBool;
  value.integer = flag ? 1 : 0;
  return value;
}
FakeValue FakeValue::Text(const std::string& text) {
  FakeValue value;
  value.type = abi::kString;
  value.text = text;
  return value;
}
FakeValue FakeValue::Bytes(const std::vector<std::uint8_t>& bytes) {
  FakeValue value;
  value.type = abi::kPackedBytes;
  value.packed = bytes;
  return value;
}
FakeValue FakeValue::Vector3(float x, float y, float z) {
  FakeValue value;
  value.type = abi::kVector3;
  value.numbers = {x, y, z};
  return value;
}
FakeValue FakeValue::Vector2(float x, float y) {
  FakeValue value;
  value.type = abi::kVector2;
  value.numbers = {x, y};
  return value;
}
std::vector<float> FakeValue::Floats() const {
  std::vector<float> floats(packed.size() / sizeof(float));
  if (!floats.empty()) std::memcpy(floats.data(), packed.data(), packed.size());
  return floats;
}

}  // namespace godot_plugin
