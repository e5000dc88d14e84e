#include "client_sdk/godot/test/fake_classes.h"

#include <map>

namespace godot_plugin {
namespace {

// The classes that the plug-in uses, each with its parent.
const std::map<std::string, std::string>& Parents() {
  static const std::map<std::string, std::string> parents = {
      {"TesseraWorld", "Node3D"},
      {"Node3D", "Node"},
      {"MeshInstance3D", "Node3D"},
      {"MultiMeshInstance3D", "Node3D"},
      {"Node", "Object"},
      {"ArrayMesh", "Mesh"},
      {"Mesh", "RefCounted"},
      {"MultiMesh", "RefCounted"},
      {"RefCounted", "Object"},
      {"Engine", "Object"},
      {"ProjectSettings", "Object"},
  };
  return parents;
}

// The methods that they have by the engine's documents.
const std::map<std::string, std::map<std::string, KnownMethod>>& Known() {
  static const std::map<std::string, std::map<std::string, KnownMethod>> known = {
      {"Node",
       {{"add_child", {{abi::kObject}, "Node"}},
        {"queue_free", {}},
        {"set_name", {{abi::kString}, ""}},
        {"set_process", {{abi::kBool}, ""}}}},
      {"Node3D", {{"set_transform", {{abi::kTransform3d}, ""}}}},
      {"MeshInstance3D", {{"set_mesh", {{abi::kObject}, "Mesh"}}}},
      {"MultiMeshInstance3D", {{"set_multimesh", {{abi::kObject}, "MultiMesh"}}}},
      {"ArrayMesh", {{"add_surface_from_arrays", {{abi::kInt, abi::kArray}, ""}}}},
      {"MultiMesh",
       {{"set_transform_format", {{abi::kInt}, ""}},
        {"set_mesh", {{abi::kObject}, "Mesh"}},
        {"set_instance_count", {{abi::kInt}, ""}},
        {"set_visible_instance_count", {{abi::kInt}, ""}},
        {"set_buffer", {{abi::kPackedFloats}, ""}}}},
      {"Engine", {{"is_editor_hint", {}}}},
      {"ProjectSettings", {{"globalize_path", {{abi::kString}, ""}}}},
  };
  return known;
}

}  // namespace

bool IsKnownClass(const std::string& name) { return Parents().count(name) > 0; }

bool IsA(std::string name, const std::string& ancestor) {
  while (name != ancestor) {
    const auto parent = Parents().find(name);
    if (parent == Parents().end()) return false;
    name = parent->second;
  }
  return true;
}

const KnownMethod* FindMethod(std::string class_name, const std::string& method) {
  for (;;) {
    if (const auto known = Known().find(class_name); known != Known().end()) {
      if (const auto at = known->second.find(method); at != known->second.end()) return &at->second;
    }
    const auto parent = Parents().find(class_name);
    if (parent == Parents().end()) return nullptr;
    class_name = parent->second;
  }
}

}  // namespace godot_plugin
