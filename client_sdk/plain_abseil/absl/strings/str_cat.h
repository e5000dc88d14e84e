// absl::StrCat on the standard library; see README.md. Thread rule: free functions on values.
#pragma once

// NOLINTBEGIN(readability-identifier-naming): names are those of Abseil

#include <charconv>
#include <cstdio>
#include <string>
#include <string_view>
#include <type_traits>

#include "absl/strings/string_view.h"

namespace absl {
namespace plain_internal {

template <class T>
void Append(std::string& to, const T& value) {
  if constexpr (std::is_convertible_v<const T&, std::string_view>) {
    to.append(std::string_view(value));
  } else if constexpr (std::is_floating_point_v<T>) {
    char text[32];
    to.append(text, static_cast<std::size_t>(std::snprintf(text, sizeof text, "%g", static_cast<double>(value))));
  } else if constexpr (std::is_same_v<T, bool>) {
    to.push_back(value ? '1' : '0');
  } else {
    static_assert(std::is_integral_v<T> || std::is_enum_v<T>);
    char text[32];
    char* end = nullptr;
    if constexpr (std::is_enum_v<T>) {
      end = std::to_chars(text, text + sizeof text, static_cast<long long>(value)).ptr;
    } else {
      end = std::to_chars(text, text + sizeof text, value).ptr;
    }
    to.append(text, static_cast<std::size_t>(end - text));
  }
}

}  // namespace plain_internal

template <class... Parts>
void StrAppend(std::string* to, const Parts&... parts) {
  (plain_internal::Append(*to, parts), ...);
}
template <class... Parts>
std::string StrCat(const Parts&... parts) {
  std::string text;
  StrAppend(&text, parts...);
  return text;
}

}  // namespace absl
// NOLINTEND(readability-identifier-naming)
