// Runtime: one Lua state with its limits: who is called, what work and memory the call has used, and why it was ended.
//
// A call that goes over a limit is ended: an error is raised that no game code can catch, and the state is ready for
// the next call. The count of instructions and bytes begins anew with each call.
//
// The rule for all C++ code that Lua calls: Lua raises errors by longjmp, which runs no destructors, and an exception
// must not cross a Lua frame. So no object with a destructor is alive where Lua may raise an error (lua_error, luaL_*,
// lua_call, and whatever allocates: pushing texts, tables, userdata), and nothing there throws. Buffers are arrays on
// the stack, or userdata that the Lua stack holds.
//
// Thread rule: one thread at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>

#include "game_sdk/include/tessera/game.h"
#include "lua.hpp"

namespace tessera::game {

// Why no more code of this call may run.
enum class End : std::uint8_t { kNone, kWork, kMemory, kDepth, kLongText };

// Types of the userdata that game code can have: values, and the state of a loop over `pairs`.
enum UserType : std::uint8_t { kUserVector, kUserRotation, kUserBody, kUserPlayer, kUserLoop, kUserTypes, kUserNone };
// Bytes of one of each type. No two are equal, so the size of a userdata names its type: no metatable has to be looked
// at in each call of the host.
inline constexpr std::size_t kUserBytes[kUserTypes] = {3 * sizeof(double), 4 * sizeof(double), 8, 9, 16};

class Runtime {
 public:
  Runtime(const tessera_game_host* host, const char* file_name);
  ~Runtime();
  Runtime(const Runtime&) = delete;
  Runtime& operator=(const Runtime&) = delete;

  static Runtime& Of(lua_State* L) { return **static_cast<Runtime**>(lua_getextraspace(L)); }
  lua_State* lua() const { return lua_; }  // nullptr where there was no memory for a state

  // A call begins; nullptr stands for loading. Its work is reported to it until `EndCall`.
  void BeginCall(tessera_game_call* call);
  // Forgets the call and lets the collector do its share of work. Requires a stack without the call's values.
  void EndCall();

  // Counts work. Returns false, and has ended the call, when that is too much.
  bool Charge(std::uint64_t instructions);
  // From here on each instruction and each allocation of the call fails.
  void Stop(End reason);

  // Writes file and line of the innermost running Lua function to `where_`, which is empty if there is none.
  void NoteWhere();

  // Whether an error may suggest a name: once in a call, as comparing names takes long and is not counted as work.
  bool TakeSuggestion() { return !std::exchange(suggested_, true); }

  const tessera_game_host* host() const { return host_; }
  tessera_game_call* call() const { return call_; }
  std::size_t used_bytes() const { return used_; }
  bool ended() const { return end_ != End::kNone; }
  End end() const { return end_; }
  const char* where() const { return where_; }
  // The file's name as Lua puts it before the line.
  const char* chunk() const { return chunk_; }

  // Registry references of the metatables, and of the bodies and players that this state has handles of.
  int metatable_references[kUserTypes] = {};
  int handle_references[kUserTypes] = {};
  // The handles of bodies that were used last, each at a place that follows from its id: their ids, and the reference
  // of the first place. They live on without being used, so that a callback a tick makes no handle a tick.
  static constexpr std::size_t kRecentHandles = 4096;
  std::uint64_t recent_ids[kRecentHandles] = {};
  int first_recent_reference = 0;

 private:
  static void* Allocate(void* runtime, void* block, std::size_t old_bytes, std::size_t new_bytes);
  static void CountHook(lua_State* L, lua_Debug*);
  void NoteArray(const void* block, std::size_t bytes);
  void NoteFree(const void* block);
  End Refusal(const void* block, std::size_t old_bytes, std::size_t new_bytes) const;
  void Collect();

  const tessera_game_host* host_;
  tessera_game_call* call_ = nullptr;
  lua_State* lua_ = nullptr;
  std::uint64_t load_work_ = 0;
  bool suggested_ = false;
  std::size_t used_ = 0, allocated_ = 0, limit_;
  std::size_t uncollected_ = 0, next_collection_ = 0;
  // Blocks of the Lua stack and of the newest array, which replaces the stack if that is freed next.
  const void *stack_ = nullptr, *newest_array_ = nullptr;
  std::size_t newest_array_bytes_ = 0;
  End end_ = End::kNone;
  char where_[96] = "";
  char chunk_[64] = "";
};

// Raises an error with the file and the line of the innermost Lua function.
[[noreturn]] void Raise(lua_State* L, const char* format, ...) __attribute__((format(printf, 2, 3)));
// Raises the error that no game code can catch. Requires an ended call.
[[noreturn]] void RaiseEnd(lua_State* L);
// Counts work of a C function, and does not return if that is too much.
inline void Charge(lua_State* L, std::uint64_t instructions) {
  if (!Runtime::Of(L).Charge(instructions)) RaiseEnd(L);
}
// Counts the reading or writing of a text. Copying 16 bytes takes less time than an instruction.
inline void ChargeText(lua_State* L, std::size_t bytes) { Charge(L, 1 + bytes / 16); }
// Counts work on each byte of a text, such as a search.
inline void ChargeScan(lua_State* L, std::size_t bytes) { Charge(L, 1 + bytes / 4); }

// The kind of a userdata; kUserNone for any other value.
UserType UserTypeOf(lua_State* L, int index);

}  // namespace tessera::game
