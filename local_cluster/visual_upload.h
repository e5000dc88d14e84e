// Sends the control plane the files of meshes that a scene is drawn with, before a world is made of it.
//
//   for (const SentVisual& sent : SendVisuals(connection, scene, VisualsBeside(path))) ...
//
// Those that it has are not sent again. A scene without such files costs no call.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "tessera/v1/scene.pb.h"

namespace tessera::local {

class Connection;

// Where `tessera scene import` puts the files of a scene: the folder `visuals` beside it.
std::string VisualsBeside(const std::string& scene_path);

struct SentVisual {
  std::string file;  // path
  std::size_t bytes = 0;
};

enum class VisualSending : std::uint8_t { kSend, kOnlyCheck };

// `folder`: of <sha256>.glb. Gives those that were sent, or would be. CommandError: one that the control plane lacks is
// not in the folder, is damaged or too large, or the control plane does not take it. One that is told to keep no files,
// or that knows of none, is sent none.
std::vector<SentVisual> SendVisuals(Connection& connection, const v1::Scene& scene, const std::string& folder,
                                    VisualSending sending = VisualSending::kSend);

}  // namespace tessera::local
