// Contexts: the clusters that this user's command line knows, each with its address, authority and token.
//
// They lie in contexts.json in the user's configuration folder ($XDG_CONFIG_HOME/tessera or ~/.config/tessera), which
// only the user can read.
//
// Thread rule: one thread; another process's change between Load and Save is lost.
#pragma once

#include <map>
#include <string>

#include "cli/output.h"
#include "trust/credentials.h"

namespace tessera::local {
class Connection;
}

namespace tessera::cli {

struct Context {
  std::string address;    // HOST:PORT of the operators' door
  std::string authority;  // PEM
  std::string token;      // secret
};

struct Contexts {
  std::string current;  // empty: none
  std::map<std::string, Context> by_name;
};

std::string ContextsPath();
// None before the first Save. CommandError: the file cannot be read.
Contexts LoadContexts();
void SaveContexts(const Contexts& contexts);

// The control plane to call: --control or TESSERA_CONTROL, else --context, else the current context, else the socket
// of this user's `tessera up`. An address that a context has comes with that context's credentials; TESSERA_TOKEN takes
// the place of its token. CommandError: there is no such context.
trust::ControlPoint ControlOf(const Globals& globals);
local::Connection Connect(const Globals& globals);

}  // namespace tessera::cli
