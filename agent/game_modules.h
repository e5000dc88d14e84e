// GameModules: the native games of this host, which its operator keeps in a folder: arena.so is the game "arena".
//
//   GameModules modules({.folder = "/usr/lib/tessera/games", .region_binary = ..., .scratch = ...});
//   modules.Scan();                                   // true: list() differs from before
//   hello.mutable_game_modules() = modules.list();
//
// A module is described by the worker's program in a process of its own, which loads it as a worker would: so a list
// says what workers of this host can run, and a library that crashes while it is loaded harms nobody. One is described
// again only when its file has changed. Files whose names are none of a module are passed over, with a line in the log.
//
// Promise: `Scan` takes at most kModulePatience a changed file. Thread rule: one owner; it blocks.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "tessera/v1/agent_link.pb.h"

namespace tessera::agent {

struct GameModulesOptions {
  std::string folder;         // empty: this host has none
  std::string region_binary;  // the worker's program
  std::string scratch;        // a file that this may write
};

class GameModules {
 public:
  explicit GameModules(GameModulesOptions options) : options_(std::move(options)) {}

  // Looks through the folder. True if the list differs from the one before.
  bool Scan();
  const v1::GameModuleList& list() const { return list_; }

 private:
  // By which a file that was written anew is known.
  struct FileState {
    std::uint64_t inode = 0, size = 0;
    std::int64_t changed_ns = 0;
    friend bool operator==(const FileState&, const FileState&) = default;
  };
  struct Known {
    FileState file;
    v1::GameModule module;
  };

  std::map<std::string, FileState> Files();
  v1::GameModule Describe(const std::string& name) const;

  GameModulesOptions options_;
  std::map<std::string, Known> known_;  // by name
  v1::GameModuleList list_;
  std::string complaint_;  // about the folder, as logged last
};

// Reads how the worker's program described the module and how it ended: exposed for tests. `lines`: its last ones.
v1::GameModule ReadDescription(const std::string& name, const std::vector<std::string>& lines, const std::string& end,
                               bool ended_well);

}  // namespace tessera::agent
