// Options that have another name now. A program refuses the old one and says the new one, so that an old unit or
// script ends with exit status 2 instead of a guess.
//
//   if (const std::string refused = host::RefusedOption(argc, argv); !refused.empty()) return Usage(refused);
#pragma once

#include <array>
#include <string>
#include <string_view>

namespace tessera::host {

struct RenamedOption {
  std::string_view old_name;
  std::string_view new_name;  // as it is typed; a change of unit follows it
};

// One table serves all programs: none of them has an option by an old name.
inline constexpr std::array<RenamedOption, 8> kRenamedOptions = {{
    {"--data-dir", "--state-dir"},
    {"--http", "--metrics-listen"},
    {"--json", "-o json"},
    {"--log", "--log-level"},
    {"--failover-after-ms", "--failover-after (seconds)"},
    {"--lost-after-ms", "--lost-after (seconds)"},
    {"--metrics-port", "--metrics-listen (HOST:PORT)"},
    {"--orders", "--key-file FILE (each visitor gives orders by a right of his own)"},
}};

// "--data-dir is called --state-dir now" for the first old name among the arguments before "--"; empty if there is
// none.
std::string RefusedOption(int argc, const char* const* argv);

}  // namespace tessera::host
