// LoadPlane: a control plane of what a store holds, by the machine's clocks, as a reign makes it.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <utility>

#include "control_plane/control_plane.h"
#include "control_plane/secrets.h"

namespace tessera::control {

// Null, and the test has failed, where the store cannot be read. The store outlives it. Without `files` no checkpoints
// are kept, and nothing comes in pieces.
inline std::unique_ptr<ControlPlane> LoadPlane(Store& store, const ControlSettings& settings = {},
                                               std::unique_ptr<CheckpointFiles> files = nullptr) {
  auto cluster = Cluster::Load(store, settings, SystemRandomBytes, ControlPlane::ReadClocks());
  EXPECT_TRUE(cluster.ok()) << cluster.status();
  return cluster.ok() ? std::make_unique<ControlPlane>(store, *std::move(cluster), std::move(files)) : nullptr;
}

}  // namespace tessera::control
