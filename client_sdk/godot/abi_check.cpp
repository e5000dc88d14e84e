// Holds abi.h against the engine's own header, at compile time: layouts, numbers, and each function's arguments. Built
// where TESSERA_GODOT_HEADERS names the folder of gdextension_interface.h; there is nothing to run.
#include <gdextension_interface.h>

#include <type_traits>

#include "abi.h"

namespace godot_plugin::abi {
namespace {

// Two types that are passed in the same way: any pointer is as good as another, and an enum is its number.
template <class A, class B>
constexpr bool SameArgument() {
  if constexpr (std::is_pointer_v<A> && std::is_pointer_v<B>) {
    return true;
  } else if constexpr (std::is_void_v<A> || std::is_void_v<B>) {
    return std::is_void_v<A> && std::is_void_v<B>;
  } else {
    return sizeof(A) == sizeof(B) && !std::is_pointer_v<A> && !std::is_pointer_v<B> &&
           std::is_floating_point_v<A> == std::is_floating_point_v<B>;
  }
}

template <class A, class B>
struct SameCall : std::false_type {};
template <class R, class... A, class S, class... B>
struct SameCall<R (*)(A...), S (*)(B...)> {
  static constexpr bool Arguments() {
    if constexpr (sizeof...(A) == sizeof...(B)) return (SameArgument<A, B>() && ...);
    return false;
  }
  static constexpr bool value = SameArgument<R, S>() && Arguments();
};

#define TESSERA_GODOT_CHECK(member, name, type, ours) \
  static_assert(SameCall<ours, GDExtensionInterface##type>::value, #name);
TESSERA_GODOT_FUNCTIONS(TESSERA_GODOT_CHECK)

#define TESSERA_GODOT_SAME(ours, theirs) static_assert(static_cast<int>(ours) == static_cast<int>(theirs), #theirs);
TESSERA_GODOT_SAME(kNil, GDEXTENSION_VARIANT_TYPE_NIL)
TESSERA_GODOT_SAME(kBool, GDEXTENSION_VARIANT_TYPE_BOOL)
TESSERA_GODOT_SAME(kInt, GDEXTENSION_VARIANT_TYPE_INT)
TESSERA_GODOT_SAME(kFloat, GDEXTENSION_VARIANT_TYPE_FLOAT)
TESSERA_GODOT_SAME(kString, GDEXTENSION_VARIANT_TYPE_STRING)
TESSERA_GODOT_SAME(kVector2, GDEXTENSION_VARIANT_TYPE_VECTOR2)
TESSERA_GODOT_SAME(kVector3, GDEXTENSION_VARIANT_TYPE_VECTOR3)
TESSERA_GODOT_SAME(kTransform3d, GDEXTENSION_VARIANT_TYPE_TRANSFORM3D)
TESSERA_GODOT_SAME(kStringName, GDEXTENSION_VARIANT_TYPE_STRING_NAME)
TESSERA_GODOT_SAME(kObject, GDEXTENSION_VARIANT_TYPE_OBJECT)
TESSERA_GODOT_SAME(kDictionary, GDEXTENSION_VARIANT_TYPE_DICTIONARY)
TESSERA_GODOT_SAME(kArray, GDEXTENSION_VARIANT_TYPE_ARRAY)
TESSERA_GODOT_SAME(kPackedBytes, GDEXTENSION_VARIANT_TYPE_PACKED_BYTE_ARRAY)
TESSERA_GODOT_SAME(kPackedFloats, GDEXTENSION_VARIANT_TYPE_PACKED_FLOAT32_ARRAY)
TESSERA_GODOT_SAME(kPackedVectors, GDEXTENSION_VARIANT_TYPE_PACKED_VECTOR3_ARRAY)
TESSERA_GODOT_SAME(kCallOk, GDEXTENSION_CALL_OK)
TESSERA_GODOT_SAME(kInvalidMethod, GDEXTENSION_CALL_ERROR_INVALID_METHOD)
TESSERA_GODOT_SAME(kInvalidArgument, GDEXTENSION_CALL_ERROR_INVALID_ARGUMENT)
TESSERA_GODOT_SAME(kTooManyArguments, GDEXTENSION_CALL_ERROR_TOO_MANY_ARGUMENTS)
TESSERA_GODOT_SAME(kTooFewArguments, GDEXTENSION_CALL_ERROR_TOO_FEW_ARGUMENTS)
TESSERA_GODOT_SAME(kSceneLevel, GDEXTENSION_INITIALIZATION_SCENE)
TESSERA_GODOT_SAME(kMethodFlagsDefault, GDEXTENSION_METHOD_FLAGS_DEFAULT)

#define TESSERA_GODOT_SIZE(ours, theirs) static_assert(sizeof(ours) == sizeof(theirs), #theirs);
#define TESSERA_GODOT_FIELD(ours, field, theirs, their_field)                                                         \
  static_assert(offsetof(ours, field) == offsetof(theirs, their_field) &&                                             \
                    sizeof(static_cast<ours*>(nullptr)->field) == sizeof(static_cast<theirs*>(nullptr)->their_field), \
                #theirs "." #their_field);
TESSERA_GODOT_SIZE(CallError, GDExtensionCallError)
TESSERA_GODOT_FIELD(CallError, kind, GDExtensionCallError, error)
TESSERA_GODOT_FIELD(CallError, argument, GDExtensionCallError, argument)
TESSERA_GODOT_FIELD(CallError, expected, GDExtensionCallError, expected)
TESSERA_GODOT_SIZE(PropertyInfo, GDExtensionPropertyInfo)
TESSERA_GODOT_FIELD(PropertyInfo, type, GDExtensionPropertyInfo, type)
TESSERA_GODOT_FIELD(PropertyInfo, name, GDExtensionPropertyInfo, name)
TESSERA_GODOT_FIELD(PropertyInfo, class_name, GDExtensionPropertyInfo, class_name)
TESSERA_GODOT_FIELD(PropertyInfo, hint, GDExtensionPropertyInfo, hint)
TESSERA_GODOT_FIELD(PropertyInfo, hint_string, GDExtensionPropertyInfo, hint_string)
TESSERA_GODOT_FIELD(PropertyInfo, usage, GDExtensionPropertyInfo, usage)
TESSERA_GODOT_SIZE(MethodInfo, GDExtensionClassMethodInfo)
TESSERA_GODOT_FIELD(MethodInfo, name, GDExtensionClassMethodInfo, name)
TESSERA_GODOT_FIELD(MethodInfo, userdata, GDExtensionClassMethodInfo, method_userdata)
TESSERA_GODOT_FIELD(MethodInfo, call, GDExtensionClassMethodInfo, call_func)
TESSERA_GODOT_FIELD(MethodInfo, typed_call, GDExtensionClassMethodInfo, ptrcall_func)
TESSERA_GODOT_FIELD(MethodInfo, flags, GDExtensionClassMethodInfo, method_flags)
TESSERA_GODOT_FIELD(MethodInfo, has_result, GDExtensionClassMethodInfo, has_return_value)
TESSERA_GODOT_FIELD(MethodInfo, result, GDExtensionClassMethodInfo, return_value_info)
TESSERA_GODOT_FIELD(MethodInfo, result_metadata, GDExtensionClassMethodInfo, return_value_metadata)
TESSERA_GODOT_FIELD(MethodInfo, argument_count, GDExtensionClassMethodInfo, argument_count)
TESSERA_GODOT_FIELD(MethodInfo, arguments, GDExtensionClassMethodInfo, arguments_info)
TESSERA_GODOT_FIELD(MethodInfo, argument_metadata, GDExtensionClassMethodInfo, arguments_metadata)
TESSERA_GODOT_FIELD(MethodInfo, default_count, GDExtensionClassMethodInfo, default_argument_count)
TESSERA_GODOT_FIELD(MethodInfo, defaults, GDExtensionClassMethodInfo, default_arguments)
static_assert(SameCall<MethodCall, GDExtensionClassMethodCall>::value);
static_assert(SameCall<MethodTypedCall, GDExtensionClassMethodPtrCall>::value);
TESSERA_GODOT_SIZE(ClassInfo, GDExtensionClassCreationInfo2)
TESSERA_GODOT_FIELD(ClassInfo, is_virtual, GDExtensionClassCreationInfo2, is_virtual)
TESSERA_GODOT_FIELD(ClassInfo, is_abstract, GDExtensionClassCreationInfo2, is_abstract)
TESSERA_GODOT_FIELD(ClassInfo, is_exposed, GDExtensionClassCreationInfo2, is_exposed)
TESSERA_GODOT_FIELD(ClassInfo, notification, GDExtensionClassCreationInfo2, notification_func)
TESSERA_GODOT_FIELD(ClassInfo, create, GDExtensionClassCreationInfo2, create_instance_func)
TESSERA_GODOT_FIELD(ClassInfo, free, GDExtensionClassCreationInfo2, free_instance_func)
TESSERA_GODOT_FIELD(ClassInfo, userdata, GDExtensionClassCreationInfo2, class_userdata)
static_assert(SameCall<decltype(ClassInfo::notification), GDExtensionClassNotification2>::value);
static_assert(SameCall<decltype(ClassInfo::create), GDExtensionClassCreateInstance>::value);
static_assert(SameCall<decltype(ClassInfo::free), GDExtensionClassFreeInstance>::value);
TESSERA_GODOT_SIZE(Initialization, GDExtensionInitialization)
TESSERA_GODOT_FIELD(Initialization, minimum_level, GDExtensionInitialization, minimum_initialization_level)
TESSERA_GODOT_FIELD(Initialization, userdata, GDExtensionInitialization, userdata)
TESSERA_GODOT_FIELD(Initialization, initialize, GDExtensionInitialization, initialize)
TESSERA_GODOT_FIELD(Initialization, deinitialize, GDExtensionInitialization, deinitialize)
static_assert(SameCall<GetFunction, GDExtensionInterfaceGetProcAddress>::value);
static_assert(SameCall<Convert, GDExtensionVariantFromTypeConstructorFunc>::value);
static_assert(SameCall<Convert, GDExtensionTypeFromVariantConstructorFunc>::value);
static_assert(SameCall<Destroy, GDExtensionPtrDestructor>::value);

}  // namespace
}  // namespace godot_plugin::abi
