// CrashNote: says which callback of a native game ran when the process died of a signal.
//
//   InstallCrashNote();                                   // once, in the thread that runs the game
//   const CrashNote note("arena", "on_tick", "ball");     // as long as the library's code runs
//
// Thread rule: one thread.
#pragma once

namespace tessera::game {

class CrashNote {
 public:
  // Text that lives as long as this; `kind` is nullptr for callbacks of the world, and `callback` while it is loaded.
  CrashNote(const char* game, const char* callback, const char* kind);
  ~CrashNote();
  CrashNote(const CrashNote&) = delete;
  CrashNote& operator=(const CrashNote&) = delete;
};

// Has a line written to stderr when the process dies of a fault, or aborts, while there is a note. What the process did
// about such signals before is done after it.
void InstallCrashNote();

}  // namespace tessera::game
