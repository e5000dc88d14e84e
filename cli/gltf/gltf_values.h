// The parts of a JSON value of a glTF file. Any file may have any value anywhere, and tinygltf's own accessors ask for
// one of the right kind: these answer with the null value, or with what the caller would have otherwise.
//
// Thread rule: free functions.
#pragma once

#include <tiny_gltf.h>

#include <string>

namespace tessera::cli {

// The null value if `value` is no object, or has no such member.
const tinygltf::Value& MemberOf(const tinygltf::Value& value, const std::string& key);

std::string StringIn(const tinygltf::Value& value, const std::string& key, const std::string& otherwise);
double NumberIn(const tinygltf::Value& value, const std::string& key, double otherwise);
int IndexIn(const tinygltf::Value& value, const std::string& key);  // -1 if there is none

}  // namespace tessera::cli
