// Sandbox: a process gives up what it does not need, for good, before anybody has sent it a byte.
//
//   SandboxSpec spec{.readable = {"/state/scenes"}, .writable = {"/state/states/inst-1-2-31"}, .memory_bytes = 8 <<
//   30}; auto missing = EnterSandbox(spec);   // "" if all of it holds; else which part this kernel cannot do
//
// Promise, for the calling thread and all that it starts later: files can be read beneath `readable` and where the
// system keeps its libraries and settings, written beneath `writable`, and created and renamed beneath `append`; no
// other is opened (Landlock). No program is run, no process made, none other signalled, traced, read or written
// (seccomp). The address space has at most `memory_bytes`, and when the machine runs out of memory, this process goes
// before its agent. Threads, sockets and descriptors that are open already stay as they are.
// Thread rule: once, by the first thread, before there is another.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace tessera::worker {

struct SandboxSpec {
  std::vector<std::string> readable;  // folders or files; one that does not exist is left out
  std::vector<std::string> writable;  // folders: read, write, create, remove
  std::vector<std::string> append;    // folders: write, create, remove, but not read
  std::uint64_t memory_bytes = 0;     // 0: no limit
};

// INVALID_ARGUMENT names a folder of `writable` or `append` that cannot be opened. INTERNAL: a part that this kernel
// has was refused; the process must not go on. A kernel without Landlock (before 5.13, or left out of its `lsm=`) is no
// error: the answer names what is missing.
absl::StatusOr<std::string> EnterSandbox(const SandboxSpec& spec);

}  // namespace tessera::worker
