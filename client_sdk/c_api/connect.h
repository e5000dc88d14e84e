// Types and functions that those of <tessera/connect.h> and <tessera/local.h> share. Each header is a library of its
// own, so they see the client library by its C interface alone. Not for others.
//
// Thread rule: that of tessera.h.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "client_sdk/include/tessera/tessera.h"

namespace tessera::c_api {

// Notes the text for tessera_last_error.
inline tessera_code SetLastError(const absl::Status& status) {
  if (status.ok()) return TESSERA_OK;
  return tessera_set_last_error(static_cast<tessera_code>(status.code()), std::string(status.message()).c_str());
}
inline tessera_code RefuseArgument(const char* what) { return tessera_set_last_error(TESSERA_INVALID_ARGUMENT, what); }

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
