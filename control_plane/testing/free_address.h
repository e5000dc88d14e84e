// An address of loopback where nobody listens, for programs that do not say which port they took.
//
// Thread rule: any thread.
#pragma once

#include <string>

namespace tessera::control {

// "127.0.0.1:41233". Somebody else may take it before it is used.
std::string FreeLoopbackAddress();

}  // namespace tessera::control
