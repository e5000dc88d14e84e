// Where programs and files of one installation find each other.
#pragma once

#include <string>

namespace tessera::host {

// The folder of the running program, e.g. "/usr/bin"; empty if the kernel does not say.
std::string ProgramFolder();

}  // namespace tessera::host
