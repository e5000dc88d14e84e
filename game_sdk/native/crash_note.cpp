#include "game_sdk/native/crash_note.h"

#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstddef>
#include <cstring>
#include <iterator>

#include "game_sdk/native/native_module.h"

namespace tessera::game {
namespace {

struct Fault {
  int signal;
  const char* name;
};
constexpr Fault kFaults[] = {{SIGSEGV, "Segmentation fault"},
                             {SIGBUS, "Bus error"},
                             {SIGFPE, "Arithmetic exception"},
                             {SIGILL, "Illegal instruction"},
                             {SIGABRT, "Aborted"}};

// It says what runs now; without a game nothing does. A handler reads it in the thread that wrote it.
std::atomic<const char*> running_game, running_callback, running_kind;
struct sigaction before_note[std::size(kFaults)];
// A fault because the stack is full needs another one to be handled on.
alignas(16) char fault_stack[std::size_t{64} << 10];

// Only what a signal handler may call.
void Put(const char* text) {
  std::size_t left = std::strlen(text);
  while (left > 0) {
    const ssize_t written = write(STDERR_FILENO, text, left);
    if (written <= 0) return;
    text += written;
    left -= static_cast<std::size_t>(written);
  }
}

void WriteNote(int signal) {
  std::size_t fault = 0;
  while (kFaults[fault].signal != signal) ++fault;
  if (const char* const game = running_game.load(std::memory_order_relaxed); game != nullptr) {
    const char* const callback = running_callback.load(std::memory_order_relaxed);
    const char* const kind = running_kind.load(std::memory_order_relaxed);
    Put(kDiedInModule.data());
    Put(game);
    Put(": ");
    Put(kFaults[fault].name);
    Put(callback == nullptr ? " while it was loaded" : " in ");
    if (kind != nullptr) {
      Put("kinds.");
      Put(kind);
      Put(".");
    }
    if (callback != nullptr) Put(callback);
    Put("\n");
  }
  // The fault comes again when this returns; abort() sends its signal again.
  sigaction(signal, &before_note[fault], nullptr);
}

}  // namespace

CrashNote::CrashNote(const char* game, const char* callback, const char* kind) {
  running_callback.store(callback, std::memory_order_relaxed);
  running_kind.store(kind, std::memory_order_relaxed);
  running_game.store(game, std::memory_order_relaxed);
}

CrashNote::~CrashNote() { running_game.store(nullptr, std::memory_order_relaxed); }

void InstallCrashNote() {
  static bool installed = false;
  if (installed) return;
  installed = true;
  stack_t stack{};
  stack.ss_sp = fault_stack;
  stack.ss_size = sizeof fault_stack;
  sigaltstack(&stack, nullptr);
  for (std::size_t i = 0; i < std::size(kFaults); ++i) {
    struct sigaction act {};
    act.sa_handler = WriteNote;
    act.sa_flags = SA_ONSTACK;
    sigemptyset(&act.sa_mask);
    sigaction(kFaults[i].signal, &act, &before_note[i]);
  }
}

}  // namespace tessera::game
