// LastLines: the end of a log, for whoever reports why a program ended.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace tessera::host {

// A line longer than this is cut, in bytes: one screen of text.
inline constexpr std::size_t kMaxLineBytes = 500;

// At most the last `count` lines of a file that may be large, being written to, or hold anything at all: each is cut to
// kMaxLineBytes, and every byte that is not printable ASCII becomes '?'. Where the file has too few,
// those before come from the log before it (log_rotation.h). Empty if neither can be read. Any thread.
std::vector<std::string> LastLines(const std::string& path, std::size_t count);
// The same for the end of an error message: "\n  the line before\n  the last line".
std::string LastLinesText(const std::string& path, std::size_t count);

}  // namespace tessera::host
