// The value of --ticket: a ticket (docs/tickets.md), or the path of a file with one a line.
//
// Thread rule: any thread.
#pragma once

#include <string>
#include <vector>

namespace tessera::cli {

// Text that is no file's path is a ticket itself. CommandError names the file that cannot be read, or has none in it;
// the control plane judges what a ticket says.
std::vector<std::string> TicketsFrom(const std::string& argument);

}  // namespace tessera::cli
