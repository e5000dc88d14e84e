#include "host/renamed_options.h"

namespace tessera::host {

std::string RefusedOption(int argc, const char* const* argv) {
  for (int i = 1; i < argc; ++i) {
    const std::string_view argument = argv[i];
    if (argument == "--") break;
    const std::string_view name = argument.substr(0, argument.find('='));
    for (const RenamedOption& renamed : kRenamedOptions) {
      if (name != renamed.old_name) continue;
      return std::string(renamed.old_name) + " is called " + std::string(renamed.new_name) + " now";
    }
  }
  return "";
}

}  // namespace tessera::host
