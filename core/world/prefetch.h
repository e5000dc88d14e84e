// Prefetch: asks for memory some iterations before a loop works on it, where it lies in no order that a processor could
// guess.
//
// Inlined in any case: GCC takes a function that only prefetches for one that does nothing, and leaves out its calls.
// Thread rule: none; nothing is read.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace tessera {

// All cache lines of `bytes` bytes from `at` on, which may be null or any other address: it is counted as a number,
// since a pointer may not leave its object.
[[gnu::always_inline]] inline void Prefetch(const void* at, std::size_t bytes) {
  constexpr std::size_t kLine = 64;
  const auto begin = reinterpret_cast<std::uintptr_t>(at);
  for (std::size_t i = 0; i < bytes; i += kLine) __builtin_prefetch(reinterpret_cast<const void*>(begin + i));
}

// The first `bytes` of the object to which a loop over `objects` comes some iterations after number i.
template <class Object>
[[gnu::always_inline]] inline void PrefetchAfter(std::size_t i, std::span<Object* const> objects, std::size_t bytes) {
  constexpr std::size_t kAhead = 4;
  if (i + kAhead < objects.size()) Prefetch(objects[i + kAhead], bytes);
}

}  // namespace tessera
