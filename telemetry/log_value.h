// LogValue: text from outside as a value in a log line, so that it cannot forge a line or a key.
//
// Thread rule: a free function on values.
#pragma once

#include <string>
#include <string_view>

namespace tessera::telemetry {

// `text` as a value after `key=`: as it is where it is plain, else in double quotes with \", \\, \n, \r, \t and \xNN.
std::string LogValue(std::string_view text);

}  // namespace tessera::telemetry
