// Names the cluster that checkpoints in a folder or bucket are of: the id is in its store, and beside its checkpoints.
//
// A control plane that begins on another cluster's store would list none of the checkpoints beside it, and number its
// worlds over theirs. Both are marked when they are first met together; a backup of the store has its mark.
//
// Thread rule: free functions; one caller at a time.
#pragma once

#include <string>

#include "absl/status/status.h"
#include "control_plane/checkpoint_files.h"
#include "control_plane/secrets.h"
#include "control_plane/store.h"

namespace tessera::control {

inline constexpr char kClusterKey[] = "cluster";

// FAILED_PRECONDITION: the checkpoints are not those of this store, which is empty, or is another cluster's. A store or
// a target that cannot be written or does not answer is no hindrance: they are marked another time. `store_name` is for
// errors. A bucket that was found to be this cluster's is not asked again.
absl::Status CheckBelongTogether(Store& store, const CheckpointFiles& files, const std::string& store_name,
                                 const RandomBytes& random);

}  // namespace tessera::control
