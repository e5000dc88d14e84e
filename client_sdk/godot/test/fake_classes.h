// The engine's classes that the plug-in uses, with their methods, as the engine's documents state them.
//
// Thread rule: constants.
#pragma once

#include <string>
#include <vector>

#include "client_sdk/godot/abi.h"

namespace godot_plugin {

struct KnownMethod {
  std::vector<abi::Type> arguments;
  std::string of_class;  // the class of the first argument, where that is an object
};

bool IsKnownClass(const std::string& name);
bool IsA(std::string name, const std::string& ancestor);
// A class's own or an ancestor's; null: there is none of that name.
const KnownMethod* FindMethod(std::string class_name, const std::string& method);

}  // namespace godot_plugin
