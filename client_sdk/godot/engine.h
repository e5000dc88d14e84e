// The engine's functions, and its values as C++ has them: Name is a StringName, Text a String,
// Value a Variant. All calls go by the
// names of methods, so one binary serves every engine since 4.2, whatever it was built with.
//
// Thread rule: the engine's main thread alone, between Load and Unload.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "abi.h"

namespace godot_plugin {

struct EngineFunctions {
#define TESSERA_GODOT_MEMBER(member, name, type, ours) abi::member##_function member = nullptr;
  TESSERA_GODOT_FUNCTIONS(TESSERA_GODOT_MEMBER)
#undef TESSERA_GODOT_MEMBER
  void* library = nullptr;  // the plug-in, as the engine knows it

  // False: the engine is older than the plug-in asks for, and lacks `missing`.
  bool Load(abi::GetFunction get, void* the_library, const char*& missing);
};
EngineFunctions& Engine();

// Writes a line to the engine's log, as an error.
void ReportError(const std::string& line);

class Name {
 public:
  explicit Name(const char* text) { Engine().name_new(bytes_.data(), text); }
  ~Name() { Engine().destructor(abi::kStringName)(bytes_.data()); }
  Name(const Name&) = delete;
  Name& operator=(const Name&) = delete;

  const void* get() const { return bytes_.data(); }
  void* get() { return bytes_.data(); }

 private:
  alignas(8) std::array<unsigned char, abi::kStringBytes> bytes_{};
};

class Text {
 public:
  explicit Text(std::string_view text) {
    Engine().string_new(bytes_.data(), text.data(), static_cast<std::int64_t>(text.size()));
  }
  ~Text() { Engine().destructor(abi::kString)(bytes_.data()); }
  Text(const Text&) = delete;
  Text& operator=(const Text&) = delete;

  void* get() { return bytes_.data(); }

 private:
  alignas(8) std::array<unsigned char, abi::kStringBytes> bytes_{};
};

// Where a body is drawn: metres, and a quaternion x, y, z, w.
struct Pose {
  std::array<double, 3> position{};
  std::array<double, 4> orientation{0, 0, 0, 1};

  friend bool operator==(const Pose& a, const Pose& b) {
    return a.position == b.position && a.orientation == b.orientation;
  }
  // A pose in the frame of this one.
  Pose Of(const Pose& inner) const;
  // Rows of the rotation, each with its part of the position, as the engine's buffers have it.
  std::array<float, 12> Rows() const;
};

class Value {
 public:
  Value() { Engine().variant_nil(bytes_.data()); }
  ~Value() { Engine().variant_destroy(bytes_.data()); }
  Value(const Value& other) { Engine().variant_copy(bytes_.data(), other.get()); }
  Value(Value&& other) noexcept : Value() { bytes_.swap(other.bytes_); }
  Value& operator=(Value other) noexcept {
    bytes_.swap(other.bytes_);
    return *this;
  }
  explicit Value(bool flag);
  explicit Value(std::int64_t number);
  explicit Value(double number);
  explicit Value(std::string_view text);
  explicit Value(const char* text) : Value(std::string_view(text)) {}
  explicit Value(const Name& name);
  explicit Value(const Pose& pose);
  explicit Value(const std::array<double, 3>& vector);

  static Value Object(void* object);
  static Value Bytes(const std::uint8_t* bytes, std::size_t size);
  static Value Floats(const std::vector<float>& floats);
  static Value Vectors(const std::vector<float>& xyz);  // three each
  static Value Array(std::size_t size);
  static Value Dictionary();
  // From memory of the engine that has this type; kNil: another Variant.
  static Value FromType(abi::Type type, const void* from);

  abi::Type type() const { return Engine().variant_type(bytes_.data()); }
  bool nil() const { return type() == abi::kNil; }
  bool AsBool() const;
  std::int64_t AsInt() const;
  double AsReal() const;
  std::string AsText() const;
  std::array<double, 3> AsVector3() const;
  std::array<double, 2> AsVector2() const;
  std::vector<std::uint8_t> AsBytes() const;
  void* AsObject() const;
  // Into memory that has a value of this type already.
  void AssignTo(abi::Type type, void* to) const;

  void Set(std::int64_t index, const Value& value);
  void Set(const Value& key, const Value& value);

  // Calls a method of an object, or of another value. What the engine refuses is reported, and gives nil.
  template <class... Arguments>
  Value Call(const Name& method, const Arguments&... arguments) const {
    const std::array<const void*, sizeof...(Arguments) + 1> listed = {arguments.get()..., nullptr};
    return CallWith(method, listed.data(), sizeof...(Arguments));
  }
  template <class... Arguments>
  Value Call(const char* method, const Arguments&... arguments) const {
    return Call(Name(method), arguments...);
  }

  const void* get() const { return bytes_.data(); }
  void* get() { return bytes_.data(); }

 private:
  void From(abi::Type type, void* from);
  void To(abi::Type type, void* to) const;
  Value CallWith(const Name& method, const void* const* arguments, std::size_t count) const;
  static Value Made(abi::Type type);

  alignas(8) std::array<unsigned char, abi::kVariantBytes> bytes_{};
};

// A new object of the engine. One that counts references lives as long as values hold it; a node until it is freed.
Value NewObject(const char* class_name);

// A node that others may free at any time.
class Node {
 public:
  Node() = default;
  explicit Node(const Value& object);

  // Null once it is freed.
  void* Find() const { return id_ == 0 ? nullptr : Engine().object_of_id(id_); }
  // Frees it at the end of the frame, if it is there still.
  void Free();

 private:
  std::uint64_t id_ = 0;
};

}  // namespace godot_plugin
