// The value of a property as the command line takes it: a text that is read as the type which the scene declares.
//
// Thread rule: free functions on values.
#pragma once

#include <string>

#include "tessera/v1/instance.pb.h"

namespace tessera::cli {

// "true", "7", "1.5", "1,2,3", bytes as hexadecimal digits, the id of a body, or any text. `of_world`: the property is
// the world's own, and else a body's. CommandError: the scene declares none of that name, or its type is another.
v1::Property ReadProperty(const v1::Instance& instance, bool of_world, const std::string& name,
                          const std::string& value);

}  // namespace tessera::cli
