// Types and functions that the functions of <tessera/connect.h> share. They are a library of their own, so they see the
// client library by its C interface alone. Not for others.
//
// Thread rule: that of tessera.h.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "client_sdk/include/tessera/connect.h"

namespace tessera::c_api {

// Notes the text for tessera_last_error.
tessera_code SetLastError(const absl::Status& status);
tessera_code RefuseArgument(const char* what);  // TESSERA_INVALID_ARGUMENT
std::string ControlAddress(const char* given);  // NULL and "": the socket of this user's `tessera up`

// Whether a struct has at least the fields without which it says nothing; if not, tessera_last_error names the
// argument.
inline bool IsAtLeast(std::size_t bytes, std::size_t least, const char* argument) {
  if (bytes >= least) return true;
  RefuseArgument(
      absl::StrCat(argument, ": has ", bytes, " bytes, at least ", least, "; the TESSERA_... initialisers set it")
          .c_str());
  return false;
}

}  // namespace tessera::c_api
