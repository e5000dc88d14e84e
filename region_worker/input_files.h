// The files that a worker's orders name: the scene, the game, and the state that the region begins with.
#pragma once

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "core/region/region.h"
#include "core/world/scene.h"

namespace tessera::worker {

// Text or a serialised tessera.v1.Scene, as an agent writes it, by the ending of the path. Errors are one line: the
// file cannot be read, or what LoadScene finds; `hash` is the one that the scene must have, empty for any.
absl::StatusOr<std::shared_ptr<const Scene>> LoadSceneFile(const std::string& path, const std::string& hash = {});

// Unread; errors name the file: it cannot be read, or is larger than a game may be.
absl::StatusOr<std::string> ReadGameFile(const std::string& path);

// NOT_FOUND names the file.
absl::StatusOr<region::Bytes> ReadStateFile(const std::string& path);

}  // namespace tessera::worker
