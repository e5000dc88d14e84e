// UTF-8 (RFC 3629), as text fields of messages must be: a parser refuses a whole message for one byte that is not.
//
//   line.set_text(ValidUtf8(text_of_a_game));
//
// Thread rule: free functions on values.
#pragma once

#include <string>
#include <string_view>

namespace tessera {

bool IsUtf8(std::string_view text);

// `text` with a '?' in place of each byte that belongs to no character.
std::string ValidUtf8(std::string_view text);

}  // namespace tessera
