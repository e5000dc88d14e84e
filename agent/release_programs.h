// ReleasePrograms: the worker's programs of several releases, of which a world keeps the one that it began with.
//
//   ReleasePrograms programs({.own_release = "0.2.0", .own_program = "/usr/bin/tessera-region", .folder = ...});
//   programs.releases()              // {"0.1.0", "0.2.0"}, for the hello
//   programs.ProgramOf("0.1.0")      // "/usr/lib/tessera/releases/0.1.0/tessera-region"
//
// The folder has one for each release, with its tessera-region in it; what is neither is passed over. It is looked
// through once: who installs or removes a release restarts the agent. Thread rule: any thread.
#pragma once

#include <map>
#include <string>
#include <vector>

namespace tessera::agent {

struct ReleaseProgramsOptions {
  std::string own_release;  // this agent's
  std::string own_program;  // where the folder has none of it, or `own_program_given`
  bool own_program_given = false;
  std::string folder;  // empty, or not there: the own release alone
};

class ReleasePrograms {
 public:
  explicit ReleasePrograms(const ReleaseProgramsOptions& options);

  // Ascending, the own one among them; the newest 16.
  std::vector<std::string> releases() const;
  // The program of a release; an empty one is the agent's own. Empty: it is not here.
  std::string ProgramOf(const std::string& release) const;

 private:
  std::string own_release_;
  std::map<std::string, std::string> programs_;  // by release
};

// Whether the text names a release, "0.1.0", as a folder and an order may: three numbers.
bool IsReleaseName(const std::string& text);

}  // namespace tessera::agent
