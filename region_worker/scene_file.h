// The scene that a worker runs, read from the file that its order names.
#pragma once

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "core/world/scene.h"

namespace tessera::worker {

// A file that ends in .textproto, .txtpb or .json is text, any other a serialised tessera.v1.Scene, as an agent writes
// it. Errors are one line: the file cannot be read, what ResolveScene says, or that its hash is not `hash` (unless
// empty).
absl::StatusOr<std::shared_ptr<const Scene>> LoadSceneFile(const std::string& path, const std::string& hash = {});

}  // namespace tessera::worker
