// Table: columns that line up, as every listing of the command line prints them. First row is the header.
#pragma once

#include <string>
#include <vector>

namespace tessera::cli {

using TableRow = std::vector<std::string>;

// Left-aligned text, two spaces between columns, a line a row; numbers-only columns are right-aligned.
std::string FormatTable(const std::vector<TableRow>& rows);

// "42s", "3m", "5h", "2d": the age of something `seconds` old.
std::string FormatAge(long long seconds);
// "1.2kB", "3.4MB": powers of 1000.
std::string FormatBytes(double bytes);
// "0.12ms" from seconds.
std::string FormatMillis(double seconds);

}  // namespace tessera::cli
