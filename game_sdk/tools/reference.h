// Reference: what game code may call and is called with, written from the table (game_sdk/api/api.h) for people and for
// editors. A new line of the table needs no change here.
//
// Thread rule: functions of their arguments.
#pragma once

#include <string>
#include <string_view>

#include "absl/status/statusor.h"

namespace tessera::game {

// Markdown: tables of functions and callbacks.
std::string GameReference();
// Annotations that the Lua language server reads: a file that begins with ---@meta.
std::string GameAnnotations();

// A document with the reference anew between the two lines that mark it, which are `kReferenceBegin` and
// `kReferenceEnd`. INVALID_ARGUMENT: it has no such lines.
absl::StatusOr<std::string> WithReference(std::string_view document);
inline constexpr std::string_view kReferenceBegin =
    "<!-- reference: `tessera game reference docs/games.md` writes it -->\n";
inline constexpr std::string_view kReferenceEnd = "<!-- end of the reference -->\n";

}  // namespace tessera::game
