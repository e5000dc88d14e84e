#include "engine.h"

#include <array>
#include <cstring>
#include <string>
#include <vector>

namespace godot_plugin {
namespace {

using Real3 = std::array<float, 3>;  // the engine's Vector3, of single precision

// A value of the engine's own, in memory of its size; destroyed at the end.
template <std::size_t kBytes>
class Typed {
 public:
  explicit Typed(abi::Type type) : type_(type) {}
  ~Typed() {
    if (const abi::Destroy destroy = Engine().destructor(type_); destroy != nullptr) destroy(bytes_.data());
  }
  Typed(const Typed&) = delete;
  Typed& operator=(const Typed&) = delete;
  void* get() { return bytes_.data(); }

 private:
  abi::Type type_;
  alignas(8) std::array<unsigned char, kBytes> bytes_{};
};

// A packed array of so many zeros, and the same as a Variant once it is filled.
Value Packed(abi::Type type, std::size_t size, void (*fill)(void* array, const void* from), const void* from) {
  Typed<abi::kPackedArrayBytes> array(type);
  {
    abi::CallError error{};
    Value empty;
    Engine().variant_construct(type, empty.get(), nullptr, 0, &error);
    empty.Call("resize", Value(static_cast<std::int64_t>(size)));
    Engine().to_type(type)(array.get(), empty.get());
  }  // so that `array` alone holds the memory, and writing copies nothing
  if (size > 0) fill(array.get(), from);
  return Value::FromType(type, array.get());
}

}  // namespace

EngineFunctions& Engine() {
  static EngineFunctions functions;
  return functions;
}

bool EngineFunctions::Load(abi::GetFunction get, void* the_library, const char*& missing) {
  library = the_library;
#define TESSERA_GODOT_LOAD(member, name, type, ours)               \
  (member) = reinterpret_cast<abi::member##_function>(get(#name)); \
  if ((member) == nullptr) {                                       \
    missing = #name;                                               \
    return false;                                                  \
  }
  TESSERA_GODOT_FUNCTIONS(TESSERA_GODOT_LOAD)
#undef TESSERA_GODOT_LOAD
  return true;
}

void ReportError(const std::string& line) { Engine().print_error("tessera", line.c_str(), "tessera", "tessera", 0, 0); }

Pose Pose::Of(const Pose& inner) const {
  const auto& [x, y, z, w] = orientation;
  const auto& [a, b, c, d] = inner.orientation;
  Pose whole;
  whole.orientation = {w * a + x * d + y * c - z * b, w * b - x * c + y * d + z * a, w * c + x * b - y * a + z * d,
                       w * d - x * a - y * b - z * c};
  const auto& [px, py, pz] = inner.position;
  const double tx = 2 * (y * pz - z * py), ty = 2 * (z * px - x * pz), tz = 2 * (x * py - y * px);
  whole.position = {position[0] + px + w * tx + y * tz - z * ty, position[1] + py + w * ty + z * tx - x * tz,
                    position[2] + pz + w * tz + x * ty - y * tx};
  return whole;
}

std::array<float, 12> Pose::Rows() const {
  const auto& [x, y, z, w] = orientation;
  const auto f = [](double number) { return static_cast<float>(number); };
  return {f(1 - 2 * (y * y + z * z)), f(2 * (x * y - w * z)),     f(2 * (x * z + w * y)),     f(position[0]),
          f(2 * (x * y + w * z)),     f(1 - 2 * (x * x + z * z)), f(2 * (y * z - w * x)),     f(position[1]),
          f(2 * (x * z - w * y)),     f(2 * (y * z + w * x)),     f(1 - 2 * (x * x + y * y)), f(position[2])};
}

void Value::From(abi::Type type, void* from) { Engine().from_type(type)(bytes_.data(), from); }

void Value::To(abi::Type type, void* to) const {
  // The engine takes a pointer that could be written to, and only reads.
  Engine().to_type(type)(to, const_cast<unsigned char*>(bytes_.data()));
}

Value::Value(bool flag) {
  std::uint8_t byte = flag ? 1 : 0;
  From(abi::kBool, &byte);
}
Value::Value(std::int64_t number) { From(abi::kInt, &number); }
Value::Value(double number) { From(abi::kFloat, &number); }
Value::Value(std::string_view text) {
  Text string(text);
  From(abi::kString, string.get());
}
Value::Value(const Name& name) { From(abi::kStringName, const_cast<void*>(name.get())); }
Value::Value(const std::array<double, 3>& vector) {
  Real3 single = {static_cast<float>(vector[0]), static_cast<float>(vector[1]), static_cast<float>(vector[2])};
  From(abi::kVector3, single.data());
}
Value::Value(const Pose& pose) {
  const std::array<float, 12> r = pose.Rows();
  std::array<float, 12> basis_then_origin = {r[0], r[1], r[2], r[4], r[5], r[6], r[8], r[9], r[10], r[3], r[7], r[11]};
  From(abi::kTransform3d, basis_then_origin.data());
}

Value Value::Object(void* object) {
  Value value;
  value.From(abi::kObject, &object);
  return value;
}

Value Value::FromType(abi::Type type, const void* from) {
  Value value;
  if (type == abi::kNil) {
    Engine().variant_copy(value.get(), from);
  } else {
    value.From(type, const_cast<void*>(from));
  }
  return value;
}

Value Value::Bytes(const std::uint8_t* bytes, std::size_t size) {
  const std::string_view all(reinterpret_cast<const char*>(bytes), size);
  return Packed(
      abi::kPackedBytes, size,
      [](void* array, const void* from) {
        const auto& text = *static_cast<const std::string_view*>(from);
        std::memcpy(Engine().bytes_at_to_write(array, 0), text.data(), text.size());
      },
      &all);
}

Value Value::Floats(const std::vector<float>& floats) {
  return Packed(
      abi::kPackedFloats, floats.size(),
      [](void* array, const void* from) {
        const auto& all = *static_cast<const std::vector<float>*>(from);
        std::memcpy(Engine().floats_at(array, 0), all.data(), all.size() * sizeof(float));
      },
      &floats);
}

Value Value::Vectors(const std::vector<float>& xyz) {
  return Packed(
      abi::kPackedVectors, xyz.size() / 3,
      [](void* array, const void* from) {
        const auto& all = *static_cast<const std::vector<float>*>(from);
        std::memcpy(Engine().vectors_at(array, 0), all.data(), all.size() / 3 * sizeof(Real3));
      },
      &xyz);
}

Value Value::Made(abi::Type type) {
  Value value;  // nil holds nothing, so it may be overwritten
  abi::CallError error{};
  Engine().variant_construct(type, value.get(), nullptr, 0, &error);
  return value;
}

Value Value::Array(std::size_t size) {
  Value array = Made(abi::kArray);
  array.Call("resize", Value(static_cast<std::int64_t>(size)));
  return array;
}

Value Value::Dictionary() { return Made(abi::kDictionary); }

bool Value::AsBool() const {
  std::uint8_t flag = 0;
  To(abi::kBool, &flag);
  return flag != 0;
}
std::int64_t Value::AsInt() const {
  std::int64_t number = 0;
  To(abi::kInt, &number);
  return number;
}
double Value::AsReal() const {
  double number = 0;
  To(abi::kFloat, &number);
  return number;
}
std::string Value::AsText() const {
  Typed<abi::kStringBytes> string(abi::kString);
  To(abi::kString, string.get());
  std::string text(static_cast<std::size_t>(Engine().string_read(string.get(), nullptr, 0)), 0);
  Engine().string_read(string.get(), text.data(), static_cast<std::int64_t>(text.size()));
  return text;
}
std::array<double, 3> Value::AsVector3() const {
  Real3 vector{};
  To(abi::kVector3, vector.data());
  return {vector[0], vector[1], vector[2]};
}
std::array<double, 2> Value::AsVector2() const {
  std::array<float, 2> vector{};
  To(abi::kVector2, vector.data());
  return {vector[0], vector[1]};
}
std::vector<std::uint8_t> Value::AsBytes() const {
  const auto size = static_cast<std::size_t>(Call("size").AsInt());
  if (size == 0) return {};
  Typed<abi::kPackedArrayBytes> array(abi::kPackedBytes);
  To(abi::kPackedBytes, array.get());
  const std::uint8_t* first = Engine().bytes_at(array.get(), 0);
  return {first, first + size};
}
void* Value::AsObject() const {
  if (type() != abi::kObject) return nullptr;
  void* object = nullptr;
  To(abi::kObject, static_cast<void*>(&object));
  return object;
}

void Value::AssignTo(abi::Type type, void* to) const {
  if (type == abi::kNil) {
    Engine().variant_destroy(to);
    Engine().variant_copy(to, get());
    return;
  }
  if (const abi::Destroy destroy = Engine().destructor(type); destroy != nullptr) destroy(to);
  To(type, to);
}

void Value::Set(std::int64_t index, const Value& value) {
  std::uint8_t valid = 0, beyond = 0;
  Engine().variant_set_indexed(get(), index, value.get(), &valid, &beyond);
}

void Value::Set(const Value& key, const Value& value) {
  std::uint8_t valid = 0;
  Engine().variant_set_keyed(get(), key.get(), value.get(), &valid);
}

Value Value::CallWith(const Name& method, const void* const* arguments, std::size_t count) const {
  Value result;
  abi::CallError error{};
  Engine().variant_call(const_cast<unsigned char*>(bytes_.data()), method.get(), arguments,
                        static_cast<std::int64_t>(count), result.get(), &error);
  if (error.kind != abi::kCallOk) {
    ReportError("the engine refuses " + Value(method).AsText() + ": error " + std::to_string(error.kind) +
                " at argument " + std::to_string(error.argument));
  }
  return result;
}

Value NewObject(const char* class_name) { return Value::Object(Engine().construct_object(Name(class_name).get())); }

Node::Node(const Value& object) : id_(Engine().object_id(object.AsObject())) {}

void Node::Free() {
  if (void* object = Find(); object != nullptr) Value::Object(object).Call("queue_free");
  id_ = 0;
}

}  // namespace godot_plugin
