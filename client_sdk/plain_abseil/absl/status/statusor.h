// absl::StatusOr on the standard library; see README.md. Thread rule: that of its value.
#pragma once

// NOLINTBEGIN(readability-identifier-naming): names are those of Abseil

#include <cassert>
#include <optional>
#include <type_traits>
#include <utility>

#include "absl/status/status.h"

namespace absl {

template <class T>
class StatusOr;

namespace plain_internal {

template <class T>
inline constexpr bool kIsStatusOr = false;
template <class T>
inline constexpr bool kIsStatusOr<StatusOr<T>> = true;

}  // namespace plain_internal

template <class T>
class [[nodiscard]] StatusOr {
 public:
  using value_type = T;

  StatusOr() : status_(StatusCode::kUnknown, "") {}
  // NOLINTBEGIN(google-explicit-constructor,bugprone-forwarding-reference-overload): as in Abseil
  StatusOr(const Status& status) : status_(status) { assert(!status_.ok()); }
  StatusOr(Status&& status) : status_(std::move(status)) { assert(!status_.ok()); }
  template <class U = T>
  requires(std::is_convertible_v<U&&, T> && !plain_internal::kIsStatusOr<std::remove_cvref_t<U>> &&
           !std::is_same_v<std::remove_cvref_t<U>, Status>) StatusOr(U&& value)
      : value_(std::forward<U>(value)) {}
  template <class U>
  requires(!std::is_same_v<U, T> && std::is_constructible_v<T, U&&>) StatusOr(StatusOr<U> other) {
    if (other.ok()) {
      value_.emplace(*std::move(other));
    } else {
      status_ = std::move(other).status();
    }
  }
  // NOLINTEND(google-explicit-constructor,bugprone-forwarding-reference-overload)

  bool ok() const { return value_.has_value(); }
  const Status& status() const& { return status_; }
  Status status() && { return std::move(status_); }

  const T& value() const& { return *value_; }
  T& value() & { return *value_; }
  T&& value() && { return *std::move(value_); }
  const T& operator*() const& { return *value_; }
  T& operator*() & { return *value_; }
  T&& operator*() && { return *std::move(value_); }
  const T* operator->() const { return &*value_; }
  T* operator->() { return &*value_; }
  template <class U>
  T value_or(U&& otherwise) const& {
    return value_ ? *value_ : static_cast<T>(std::forward<U>(otherwise));
  }

 private:
  Status status_;
  std::optional<T> value_;
};

}  // namespace absl
// NOLINTEND(readability-identifier-naming)
