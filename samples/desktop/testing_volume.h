// VolumeOf: how tests tell that a mesh is closed and looks outwards. Thread rule: a free function.
#pragma once

#include <cstddef>

#include "meshes.h"

namespace desktop {

// By the divergence theorem: right only if the mesh is closed and all its triangles look outwards.
inline double VolumeOf(const Mesh& mesh) {
  double volume = 0;
  for (std::size_t i = 0; i + 2 < mesh.size(); i += 3) {
    volume += Dot(mesh[i].position, Cross(mesh[i + 1].position, mesh[i + 2].position)) / 6;
  }
  return volume;
}

}  // namespace desktop
