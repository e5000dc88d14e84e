// Values of the fake engine, and how they lie in memory: a Variant is a type and a pointer, a String, a name or an
// array the pointer alone, all else as the engine has it.
//
// Thread rule: as fake_engine.h.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "client_sdk/godot/abi.h"

namespace godot_plugin {

// A value, whatever its type.
struct FakeValue {
  abi::Type type = abi::kNil;
  std::int64_t integer = 0;  // a bool too
  double real = 0;
  std::string text;  // a name too
  std::array<float, 12> numbers{};
  std::uint64_t object = 0;  // an id; 0: null
  std::vector<FakeValue> array;
  std::map<std::string, FakeValue> dictionary;
  std::vector<std::uint8_t> packed;  // the elements' bytes

  static FakeValue Int(std::int64_t number);
  static FakeValue Real(double number);
  static FakeValue Bool(bool flag);
  static FakeValue Text(const std::string& text);
  static FakeValue Bytes(const std::vector<std::uint8_t>& bytes);
  static FakeValue Vector3(float x, float y, float z);
  static FakeValue Vector2(float x, float y);
  std::vector<float> Floats() const;
};

// Memory for a value of any type, as the engine has it on its stack.
struct Memory {
  alignas(8) std::array<unsigned char, 64> bytes{};
};

// The value of a Variant; makes one in memory that holds nothing; ends one.
const FakeValue& In(const void* variant);
void Put(void* variant, const FakeValue& value);
void DestroyVariant(void* variant);
// The value that a Variant holds, which is not nil.
FakeValue& Inside(void* variant);

// The same for memory of one type.
FakeValue TypedIn(abi::Type type, const void* from);
void PutTyped(abi::Type type, void* to, const FakeValue& value);
void DestroyTyped(void* typed);
// Whether its memory is a pointer.
bool IsPointer(abi::Type type);
FakeValue*& Pointer(void* typed);
const FakeValue& Pointed(const void* typed);

abi::Convert FromTypeFunction(abi::Type type);
abi::Convert ToTypeFunction(abi::Type type);
// Bytes of an element of a packed array.
std::size_t ElementBytes(abi::Type type);

}  // namespace godot_plugin
