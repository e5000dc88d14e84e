// The options and commands of the real programs, as their --help lists them.
//
//   EXPECT_TRUE(HelpOf("tessera instance create").options.contains("--regions"));
//
// Each program is asked once for each of its commands. Thread rule: one thread.
#pragma once

#include <map>
#include <string>
#include <vector>

namespace tessera::programs {

struct CommandHelp {
  std::map<std::string, std::string> options;  // name, e.g. "--regions", to all that is said about it
  std::vector<std::string> commands;           // names of the commands one level below
};

// Runs "tessera instance create --help" for "tessera instance create". The test fails if the program has no such help.
const CommandHelp& HelpOf(const std::string& command);

// The four installed programs, and every command of `tessera` that has no commands below it.
std::vector<std::string> AllCommands();

}  // namespace tessera::programs
