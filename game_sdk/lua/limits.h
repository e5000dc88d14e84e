// Limits of a Lua game, which bound what one callback can cost. Each has its unit, its reason, and what breaks if it
// changes. A smaller limit may refuse games that ran before.
#pragma once

#include <cstddef>
#include <cstdint>

namespace tessera::game {

// Bytes of a source. The compiler runs without a count of instructions, in time about proportional to the source.
inline constexpr std::size_t kMaxSourceBytes = std::size_t{1} << 20;
// Instructions that the file may run while it loads, when no call counts its work; about 0.1 s.
inline constexpr std::uint64_t kLoadInstructions = 10'000'000;
// Instructions between two reports of work to the host. A shorter interval slows every callback down; within a longer
// one a callback overruns its budget by more.
inline constexpr int kHookInterval = 1000;

// Bytes of a Lua state, and those of them that one callback may allocate. What a callback frees is not given back to
// it: else tables that are built anew again and again would cost no memory, and much time. Loading may allocate the
// difference, so a callback meets its own limit first, whatever is left of earlier ones.
inline constexpr std::size_t kStateBytes = std::size_t{32} << 20;
inline constexpr std::size_t kCallbackBytes = std::size_t{4} << 20;
// Bytes that a callback may allocate before the state is collected as a whole after it: stack and tables of strings
// that it enlarged would make the next callbacks cheaper than they are in a fresh state.
inline constexpr std::size_t kLargeCallbackBytes = std::size_t{1} << 20;
// Allocated bytes for which the collector makes one step between callbacks.
inline constexpr std::size_t kCollectorStepBytes = std::size_t{16} << 10;
// Lua's "step multiplier" for such a step: some 10 000 objects or table slots, 0.1 ms.
inline constexpr int kCollectorStepWork = 20;
// Bytes that a game holds after loading. The rest is for one callback and for garbage of earlier ones.
inline constexpr std::size_t kLoadedBytes = kStateBytes - 3 * kCallbackBytes;

// Bytes of the longest text. One instruction compares or copies a whole text, so this bounds its time to some 5 us.
inline constexpr std::size_t kMaxTextBytes = std::size_t{64} << 10;
// Calls within calls, looked at once in an interval of the hook, so that some hundred more can be reached.
inline constexpr int kMaxCallDepth = 1000;
// Bytes of the Lua stack: 25 000 slots, more than that many calls commonly need. One instruction copies as many
// arguments as a call has, so this bounds its time to some 20 us.
inline constexpr std::size_t kMaxStackBytes = std::size_t{400} << 10;
// Values that one call of table.unpack or string.byte returns.
inline constexpr int kMaxUnpacked = 250;
// Named values in one argument.
inline constexpr int kMaxFields = 64;
// Bytes of a line that print writes, as world.log takes them.
inline constexpr std::size_t kMaxPrintBytes = 200;
// Bytes of a path by which an error names a table; tables further down are named like the one that holds them.
inline constexpr std::size_t kMaxPathBytes = 80;

}  // namespace tessera::game
