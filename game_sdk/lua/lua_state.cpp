#include "game_sdk/lua/lua_state.h"

#include <algorithm>
#include <csetjmp>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "game_sdk/lua/limits.h"

namespace tessera::game {
namespace {

// Lua shortens longer names of files like this (LUA_IDSIZE).
void ChunkName(const char* name, char (&chunk)[64]) {
  constexpr std::size_t kLongest = LUA_IDSIZE - 1, kEnd = LUA_IDSIZE - 4;
  const std::size_t bytes = std::strlen(name);
  if (bytes <= kLongest) {
    std::snprintf(chunk, sizeof chunk, "%s", name);
  } else {
    std::snprintf(chunk, sizeof chunk, "...%s", name + bytes - kEnd);
  }
}

// Text bytes follow a header within the block that Lua allocates.
constexpr std::size_t kTextHeaderBytes = 32;

}  // namespace

Runtime::Runtime(const tessera_game_host* host, const char* file_name)
    : host_(host), limit_(kStateBytes - kCallbackBytes) {
  ChunkName(file_name, chunk_);
  lua_State* const state = lua_newstate(Allocate, this);
  if (state == nullptr) return;
  *static_cast<Runtime**>(lua_getextraspace(state)) = this;
  // Only `Collect` runs it: when a callback could see what is collected, its results would follow from the past.
  lua_gc(state, LUA_GCSTOP);
  lua_gc(state, LUA_GCINC, 0, kCollectorStepWork, 0);
  lua_ = state;
}

Runtime::~Runtime() {
  if (lua_ != nullptr) lua_close(lua_);
}

void Runtime::BeginCall(tessera_game_call* call) {
  call_ = call;
  end_ = End::kNone;
  where_[0] = '\0';
  allocated_ = 0;
  load_work_ = 0;
  suggested_ = false;
  limit_ = call == nullptr ? kStateBytes - kCallbackBytes : kCallbackBytes;
  lua_sethook(lua_, CountHook, LUA_MASKCOUNT, kHookInterval);
}

void Runtime::EndCall() {
  call_ = nullptr;
  end_ = End::kNone;
  limit_ = kStateBytes;  // the collector may allocate a little, and nothing else runs
  Collect();
}

void Runtime::Collect() {
  if (allocated_ >= kLargeCallbackBytes) {
    lua_gc(lua_, LUA_GCCOLLECT);
    uncollected_ = 0;
    next_collection_ = used_;
    return;
  }
  uncollected_ += allocated_;
  if (next_collection_ != 0) {
    // Between two collections the state grows by as much as it holds, at most by what one callback may allocate.
    if (uncollected_ < std::min(next_collection_, kCallbackBytes)) return;
    next_collection_ = 0;
    uncollected_ = kCollectorStepBytes;
  }
  for (; uncollected_ >= kCollectorStepBytes; uncollected_ -= kCollectorStepBytes) {
    if (lua_gc(lua_, LUA_GCSTEP, 0) == 0) continue;
    uncollected_ = 0;
    next_collection_ = used_;
    return;
  }
}

bool Runtime::Charge(std::uint64_t instructions) {
  if (ended()) return false;
  if (call_ != nullptr) {
    if (host_->charge(call_, instructions) == 0) return true;
  } else {
    load_work_ += instructions;
    if (load_work_ <= kLoadInstructions) return true;
  }
  Stop(End::kWork);
  return false;
}

void Runtime::Stop(End reason) {
  if (ended()) return;
  end_ = reason;
  NoteWhere();
  // Functions that run because the stack is unwound (__close) get no further than one instruction. lua_sethook may be
  // called at any time, even from the allocator or a signal.
  if (lua_ != nullptr) lua_sethook(lua_, CountHook, LUA_MASKCOUNT, 1);
}

// Allocates nothing, because the allocator calls it.
void Runtime::NoteWhere() {
  where_[0] = '\0';
  if (lua_ == nullptr) return;
  lua_Debug frame;
  for (int level = 0; lua_getstack(lua_, level, &frame) != 0; ++level) {
    if (lua_getinfo(lua_, "Sl", &frame) == 0 || frame.currentline <= 0) continue;
    std::snprintf(where_, sizeof where_, "%s:%d", frame.short_src, frame.currentline);
    return;
  }
}

void Runtime::CountHook(lua_State* L, lua_Debug*) {
  Runtime& runtime = Of(L);
  lua_Debug frame;
  if (lua_getstack(L, kMaxCallDepth, &frame) != 0) runtime.Stop(End::kDepth);
  if (!runtime.Charge(kHookInterval)) RaiseEnd(L);
}

// Lua enlarges its stack by a new array, and frees the old one before it allocates anything else. The first array of a
// state is its stack.
void Runtime::NoteArray(const void* block, std::size_t bytes) {
  if (stack_ == nullptr) stack_ = block;
  newest_array_ = block;
  newest_array_bytes_ = bytes;
}

void Runtime::NoteFree(const void* block) {
  if (block != stack_ || lua_ == nullptr) return;
  stack_ = newest_array_;
  if (newest_array_bytes_ > kMaxStackBytes) Stop(End::kDepth);
}

End Runtime::Refusal(const void* block, std::size_t old_bytes, std::size_t new_bytes) const {
  // For a new block `old_bytes` is the type of the object.
  if (block == nullptr && old_bytes == LUA_TSTRING && new_bytes > kMaxTextBytes + kTextHeaderBytes) {
    return End::kLongText;
  }
  const std::size_t growth = new_bytes - (block == nullptr ? 0 : old_bytes);
  return allocated_ + growth > limit_ || used_ + growth > kStateBytes ? End::kMemory : End::kNone;
}

void* Runtime::Allocate(void* user, void* block, std::size_t old_bytes, std::size_t new_bytes) {
  Runtime& runtime = *static_cast<Runtime*>(user);
  const std::size_t had = block == nullptr ? 0 : old_bytes;
  if (new_bytes == 0) {
    if (block != nullptr) runtime.NoteFree(block);
    std::free(block);
    runtime.used_ -= had;
    return nullptr;
  }
  if (new_bytes > had) {
    // Lua collects garbage when an allocation fails and tries again; once refused, it is refused to the end of the
    // call.
    if (runtime.end_ > End::kWork) return nullptr;
    if (const End refusal = runtime.Refusal(block, old_bytes, new_bytes); refusal != End::kNone) {
      runtime.Stop(refusal);
      return nullptr;
    }
  }
  const bool array = block == nullptr && old_bytes == 0;  // other objects have a type
  void* const moved = std::realloc(block, new_bytes);
  if (moved == nullptr) {  // glibc always shrinks a block, on which Lua relies
    runtime.Stop(End::kMemory);
    return nullptr;
  }
  if (array) runtime.NoteArray(moved, new_bytes);
  if (new_bytes > had) runtime.allocated_ += new_bytes - had;
  runtime.used_ = runtime.used_ - had + new_bytes;
  return moved;
}

void Raise(lua_State* L, const char* format, ...) {
  char text[400];
  va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  Runtime& runtime = Runtime::Of(L);
  if (runtime.ended()) RaiseEnd(L);
  runtime.NoteWhere();
  if (runtime.where()[0] == '\0') {
    lua_pushstring(L, text);
  } else {
    lua_pushfstring(L, "%s: %s", runtime.where(), text);
  }
  lua_error(L);
  std::abort();  // lua_error does not return, but is not declared so
}

void RaiseEnd(lua_State* L) {
  lua_pushnil(L);  // needs no memory
  lua_error(L);
  std::abort();
}

UserType UserTypeOf(lua_State* L, int index) {
  if (lua_type(L, index) != LUA_TUSERDATA) return kUserNone;
  switch (lua_rawlen(L, index)) {
    case kUserBytes[kUserVector]:
      return kUserVector;
    case kUserBytes[kUserRotation]:
      return kUserRotation;
    case kUserBytes[kUserBody]:
      return kUserBody;
    case kUserBytes[kUserPlayer]:
      return kUserPlayer;
    case kUserBytes[kUserLoop]:
      return kUserLoop;
    default:
      return kUserNone;
  }
}

}  // namespace tessera::game

#if defined(__SANITIZE_THREAD__)
// Debian's Lua raises errors with the checked longjmp of glibc, which the thread sanitizer does not know: it would keep
// the calls that an error leaves on its stack of calls for ever, at 230 kB a stack after some hundred errors.
extern "C" [[noreturn]] void __longjmp_chk(std::jmp_buf environment, int value) { std::longjmp(environment, value); }
#endif
