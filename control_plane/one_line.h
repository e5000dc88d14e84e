// OneLine: text from outside, made fit for a log line, an error or a reason.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace tessera::control {

// `text` on one line of at most `max_bytes`: control characters become blanks, and it is cut between characters.
std::string OneLine(std::string_view text, std::size_t max_bytes);

}  // namespace tessera::control
