#include "cli/gltf/gltf_values.h"

#include <tiny_gltf.h>

#include <string>

namespace tessera::cli {

const tinygltf::Value& MemberOf(const tinygltf::Value& value, const std::string& key) {
  static const tinygltf::Value null;
  return value.IsObject() ? value.Get(key) : null;
}

std::string StringIn(const tinygltf::Value& value, const std::string& key, const std::string& otherwise) {
  const tinygltf::Value& member = MemberOf(value, key);
  return member.IsString() ? member.Get<std::string>() : otherwise;
}

double NumberIn(const tinygltf::Value& value, const std::string& key, double otherwise) {
  const tinygltf::Value& member = MemberOf(value, key);
  return member.IsNumber() ? member.GetNumberAsDouble() : otherwise;
}

int IndexIn(const tinygltf::Value& value, const std::string& key) {
  const tinygltf::Value& member = MemberOf(value, key);
  return member.IsInt() ? member.GetNumberAsInt() : -1;
}

}  // namespace tessera::cli
