// Whether a program of ours would take a command line, found out by its --help and without running the command.
#pragma once

#include <string>
#include <vector>

namespace tessera::programs {

// Whether `words` begin with one of the four programs or with ./dev.
bool IsOurs(const std::vector<std::string>& words);

// Empty if the program has every command and option among `words`, else what it does not have. Words in capitals stand
// for something.
std::string NotAccepted(const std::vector<std::string>& words);

}  // namespace tessera::programs
