// Carries out a document: its files are written, its commands typed, and what it shows is compared with what they
// print, but for numbers.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "tests/programs/documents.h"
#include "tests/programs/terminal.h"

namespace tessera::programs {

struct Carried {
  int commands = 0, shown = 0;  // typed; lines compared
};

// Expects that every command ends with 0, or with something else where an error of ours is shown. `typed` gives what is
// typed for a command.
Carried CarryOut(
    const std::vector<Fenced>& blocks, Terminal& terminal,
    const std::function<std::string(const std::string&)>& typed = [](const std::string& command) { return command; });

}  // namespace tessera::programs
