// absl::FunctionRef on the standard library; see README.md. Thread rule: that of what it refers to.
#pragma once

// NOLINTBEGIN(readability-identifier-naming): names are those of Abseil

#include <memory>
#include <type_traits>
#include <utility>

namespace absl {

template <class Signature>
class FunctionRef;

// Refers to something that can be called, and does not keep it.
template <class R, class... Args>
class FunctionRef<R(Args...)> {
 public:
  template <class F>
  requires(!std::is_same_v<std::remove_cvref_t<F>, FunctionRef> && std::is_invocable_r_v<R, F&, Args...>)
      // NOLINTNEXTLINE(google-explicit-constructor,bugprone-forwarding-reference-overload): as in Abseil
      FunctionRef(F&& f)
      : object_(const_cast<void*>(static_cast<const void*>(std::addressof(f)))),
        call_([](void* object, Args... args) -> R {
          return (*static_cast<std::remove_reference_t<F>*>(object))(std::forward<Args>(args)...);
        }) {}

  R operator()(Args... args) const { return call_(object_, std::forward<Args>(args)...); }

 private:
  void* object_;
  R (*call_)(void*, Args...);
};

}  // namespace absl
// NOLINTEND(readability-identifier-naming)
