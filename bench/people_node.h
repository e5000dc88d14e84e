// Programs of web/testing, run by node from the folder web, where their packages are.
//
//   BundlePrograms();
//   const std::string figures = RunNode({Bundled("measure.mjs"), "--json"});
//
// Thread rule: any thread; RunNode blocks until the program has ended. CommandError, with the program's last lines, for
// one that cannot be started, fails or takes too long.
#pragma once

#include <string>
#include <vector>

#include "host/child_process.h"

namespace tessera::bench {

// Makes what can be run, from the sources as they are.
void BundlePrograms();
// Where a bundled program is, for the arguments below.
std::string Bundled(const std::string& program);
// Its standard output.
std::string RunNode(const std::vector<std::string>& arguments);
// One that goes on; `log` gets what it complains of.
host::ChildProcess StartNode(const std::vector<std::string>& arguments, const std::string& log,
                             const std::string& out = "");

}  // namespace tessera::bench
