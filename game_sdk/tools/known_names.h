// KnownNames: the names that the sandbox gives to game code, as it has them.
//
// Thread rule: a function without arguments.
#pragma once

#include <map>
#include <set>
#include <string>

namespace tessera::game {

struct KnownNames {
  std::set<std::string, std::less<>> globals;
  std::map<std::string, std::set<std::string, std::less<>>, std::less<>> libraries;  // "world": its functions
};

KnownNames NamesOfSandbox();

}  // namespace tessera::game
