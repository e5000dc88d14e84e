// absl::flat_hash_map on the standard library; see README.md. Thread rule: that of std::unordered_map.
#pragma once

// NOLINTBEGIN(readability-identifier-naming): names are those of Abseil

#include <cstdint>
#include <type_traits>
#include <unordered_map>
#include <utility>

namespace absl {
namespace plain_internal {

// Takes the parts of a key, as AbslHashValue gives them.
struct HashState {
  std::uint64_t value = 0xcbf29ce484222325;

  template <class... Parts>
  static HashState combine(HashState state, const Parts&... parts) {
    (state.Add(parts), ...);
    return state;
  }

 private:
  template <class T>
  void Add(const T& part) {
    if constexpr (std::is_integral_v<T> || std::is_enum_v<T> || std::is_pointer_v<T>) {
      std::uint64_t mixed = value ^ std::uint64_t(part);
      mixed = (mixed ^ (mixed >> 30)) * 0xbf58476d1ce4e5b9;
      mixed = (mixed ^ (mixed >> 27)) * 0x94d049bb133111eb;
      value = mixed ^ (mixed >> 31);
    } else if constexpr (requires { part.begin(); }) {
      for (const auto& one : part) Add(one);
    } else {
      *this = AbslHashValue(*this, part);
    }
  }
};

struct Hash {
  template <class T>
  std::size_t operator()(const T& key) const {
    return HashState::combine(HashState(), key).value;
  }
};

}  // namespace plain_internal

template <class Key, class Value>
class flat_hash_map : public std::unordered_map<Key, Value, plain_internal::Hash> {
 public:
  using std::unordered_map<Key, Value, plain_internal::Hash>::unordered_map;
  void prefetch(const Key&) const {}
};

}  // namespace absl
// NOLINTEND(readability-identifier-naming)
