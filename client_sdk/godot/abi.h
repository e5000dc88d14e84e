// The part of Godot's C interface that the plug-in uses, since Godot 4.2: layouts and numbers, in words of our own, so
// that no header of the engine is needed. abi_check.cpp holds all of it against gdextension_interface.h where that is.
//
// Functions come by name, from the one that the engine gives to the plug-in (engine.h). A String, StringName, Variant
// or packed array is a pointer to its bytes; each has as many as the engine's documents say for single precision on 64
// bits.
#pragma once

#include <cstddef>
#include <cstdint>

namespace godot_plugin::abi {

constexpr std::size_t kVariantBytes = 24, kStringBytes = 8, kPackedArrayBytes = 16;

enum Type : std::int32_t {
  kNil = 0,
  kBool = 1,
  kInt = 2,
  kFloat = 3,
  kString = 4,
  kVector2 = 5,
  kVector3 = 9,
  kTransform3d = 18,
  kStringName = 21,
  kObject = 24,
  kDictionary = 27,
  kArray = 28,
  kPackedBytes = 29,
  kPackedFloats = 32,
  kPackedVectors = 36,  // three floats each
};

enum CallErrorKind : std::int32_t {
  kCallOk = 0,
  kInvalidMethod = 1,
  kInvalidArgument = 2,
  kTooManyArguments = 3,
  kTooFewArguments = 4,
};
struct CallError {
  std::int32_t kind, argument, expected;
};

constexpr std::int32_t kSceneLevel = 2;  // a level of initialization: nodes can be made
constexpr std::uint32_t kMethodFlagsDefault = 1;
// Flags and hints of properties, as the engine's documents number them.
constexpr std::uint32_t kUsageDefault = 6, kUsageNilIsVariant = 1U << 17U, kHintNone = 0, kHintEnum = 2;
// Notifications of Node.
constexpr std::int32_t kNotificationReady = 13, kNotificationProcess = 17;

struct PropertyInfo {
  std::int32_t type;
  void *name, *class_name;
  std::uint32_t hint;
  void* hint_string;
  std::uint32_t usage;
};

using MethodCall = void (*)(void* userdata, void* instance, const void* const* arguments, std::int64_t count,
                            void* result, CallError* error);
using MethodTypedCall = void (*)(void* userdata, void* instance, const void* const* arguments, void* result);
struct MethodInfo {
  void *name, *userdata;
  MethodCall call;
  MethodTypedCall typed_call;
  std::uint32_t flags;
  std::uint8_t has_result;
  PropertyInfo* result;
  std::int32_t result_metadata;
  std::uint32_t argument_count;
  PropertyInfo* arguments;
  std::int32_t* argument_metadata;
  std::uint32_t default_count;
  void** defaults;
};

// Its functions that are none of ours stay null; `unused` stands for several of them.
struct ClassInfo {
  std::uint8_t is_virtual, is_abstract, is_exposed;
  void* unused[7];
  void (*notification)(void* instance, std::int32_t what, std::uint8_t reversed);
  void* unused2[3];
  void* (*create)(void* userdata);
  void (*free)(void* userdata, void* instance);
  void* unused3[5];
  void* userdata;
};

struct Initialization {
  std::int32_t minimum_level;
  void* userdata;
  void (*initialize)(void* userdata, std::int32_t level);
  void (*deinitialize)(void* userdata, std::int32_t level);
};

using AnyFunction = void (*)();
using GetFunction = AnyFunction (*)(const char* name);
using Convert = void (*)(void* to, void* from);  // constructs `to`
using Destroy = void (*)(void* value);

// All functions that are asked for: member, the engine's name, the engine's name of its type, and the type.
#define TESSERA_GODOT_FUNCTIONS(X)                                                                                     \
  X(print_error, print_error_with_message, PrintErrorWithMessage,                                                      \
    void (*)(const char* description, const char* message, const char* function, const char* file, std::int32_t line,  \
             std::uint8_t notify_editor))                                                                              \
  X(variant_copy, variant_new_copy, VariantNewCopy, void (*)(void* to, const void* from))                              \
  X(variant_nil, variant_new_nil, VariantNewNil, void (*)(void* to))                                                   \
  X(variant_destroy, variant_destroy, VariantDestroy, void (*)(void* variant))                                         \
  X(variant_call, variant_call, VariantCall,                                                                           \
    void (*)(void* self, const void* method, const void* const* arguments, std::int64_t count, void* result,           \
             CallError* error))                                                                                        \
  X(variant_construct, variant_construct, VariantConstruct,                                                            \
    void (*)(Type type, void* to, const void* const* arguments, std::int32_t count, CallError* error))                 \
  X(variant_type, variant_get_type, VariantGetType, Type (*)(const void* variant))                                     \
  X(variant_set_keyed, variant_set_keyed, VariantSetKeyed,                                                             \
    void (*)(void* self, const void* key, const void* value, std::uint8_t* valid))                                     \
  X(variant_set_indexed, variant_set_indexed, VariantSetIndexed,                                                       \
    void (*)(void* self, std::int64_t index, const void* value, std::uint8_t* valid, std::uint8_t* beyond))            \
  X(from_type, get_variant_from_type_constructor, GetVariantFromTypeConstructor, Convert (*)(Type type))               \
  X(to_type, get_variant_to_type_constructor, GetVariantToTypeConstructor, Convert (*)(Type type))                     \
  X(destructor, variant_get_ptr_destructor, VariantGetPtrDestructor, Destroy (*)(Type type))                           \
  X(string_new, string_new_with_utf8_chars_and_len, StringNewWithUtf8CharsAndLen,                                      \
    void (*)(void* to, const char* text, std::int64_t bytes))                                                          \
  X(string_read, string_to_utf8_chars, StringToUtf8Chars,                                                              \
    std::int64_t (*)(const void* string, char* text, std::int64_t capacity))                                           \
  X(name_new, string_name_new_with_utf8_chars, StringNameNewWithUtf8Chars, void (*)(void* to, const char* text))       \
  X(bytes_at, packed_byte_array_operator_index_const, PackedByteArrayOperatorIndexConst,                               \
    const std::uint8_t* (*)(const void* array, std::int64_t index))                                                    \
  X(bytes_at_to_write, packed_byte_array_operator_index, PackedByteArrayOperatorIndex,                                 \
    std::uint8_t* (*)(void* array, std::int64_t index))                                                                \
  X(floats_at, packed_float32_array_operator_index, PackedFloat32ArrayOperatorIndex,                                   \
    float* (*)(void* array, std::int64_t index))                                                                       \
  X(vectors_at, packed_vector3_array_operator_index, PackedVector3ArrayOperatorIndex,                                  \
    void* (*)(void* array, std::int64_t index))                                                                        \
  X(singleton, global_get_singleton, GlobalGetSingleton, void* (*)(const void* name))                                  \
  X(construct_object, classdb_construct_object, ClassdbConstructObject, void* (*)(const void* class_name))             \
  X(object_set_instance, object_set_instance, ObjectSetInstance,                                                       \
    void (*)(void* object, const void* class_name, void* instance))                                                    \
  X(object_id, object_get_instance_id, ObjectGetInstanceId, std::uint64_t (*)(const void* object))                     \
  X(object_of_id, object_get_instance_from_id, ObjectGetInstanceFromId, void* (*)(std::uint64_t id))                   \
  X(register_class, classdb_register_extension_class2, ClassdbRegisterExtensionClass2,                                 \
    void (*)(void* library, const void* name, const void* parent, const ClassInfo* info))                              \
  X(register_method, classdb_register_extension_class_method, ClassdbRegisterExtensionClassMethod,                     \
    void (*)(void* library, const void* class_name, const MethodInfo* info))                                           \
  X(register_property, classdb_register_extension_class_property, ClassdbRegisterExtensionClassProperty,               \
    void (*)(void* library, const void* class_name, const PropertyInfo* info, const void* setter, const void* getter)) \
  X(register_signal, classdb_register_extension_class_signal, ClassdbRegisterExtensionClassSignal,                     \
    void (*)(void* library, const void* class_name, const void* signal, const PropertyInfo* arguments,                 \
             std::int64_t count))                                                                                      \
  X(unregister_class, classdb_unregister_extension_class, ClassdbUnregisterExtensionClass,                             \
    void (*)(void* library, const void* class_name))

#define TESSERA_GODOT_TYPE(member, name, type, ours) using member##_function = ours;
TESSERA_GODOT_FUNCTIONS(TESSERA_GODOT_TYPE)
#undef TESSERA_GODOT_TYPE

}  // namespace godot_plugin::abi
