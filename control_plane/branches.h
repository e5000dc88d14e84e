// Branches of a world's time: each restore begins one, after the tick that it goes back to. What came after that tick
// is taken back: its checkpoints stay for who asks for one by its tick, and no other restore takes them.
//
//   BeginBranch(manifest, next);                                // a restore: `next` is the record after it
//   const v1::Checkpoint* newest = NewestKept(record.checkpoints());
//
// Thread rule: free functions on values.
#pragma once

#include <cstdint>

#include "control_plane/control_records.pb.h"
#include "tessera/v1/instance.pb.h"

namespace tessera::control {

using Checkpoints = google::protobuf::RepeatedPtrField<v1::Checkpoint>;

// Begins one from the checkpoint of the manifest, and marks which of the record's checkpoints are before it.
void BeginBranch(const records::Manifest& manifest, records::Instance& next);

// The newest of those that are not taken back; null: there is none.
const v1::Checkpoint* NewestKept(const Checkpoints& checkpoints);
// The same, of those before this tick; 0: of all.
const v1::Checkpoint* NewestKeptBefore(const Checkpoints& checkpoints, std::uint64_t tick);
// The one of that tick which is not taken back; null: there is none.
const v1::Checkpoint* KeptOf(const Checkpoints& checkpoints, std::uint64_t tick);
// The place of the one that is to go when there are too many: the oldest of those that are taken back, or else the
// oldest. Requires one.
int FirstToGo(const Checkpoints& checkpoints);

}  // namespace tessera::control
