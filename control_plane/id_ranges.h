// Sets of body ids as ascending, disjoint ranges: a scene numbers its bodies in runs, so that a list of thousands is a
// few ranges in a record.
//
//   *record.mutable_bodies() = ToRanges(ids);
//   TakeOut(id, *record.mutable_bodies());
//
// Thread rule: free functions on values.
#pragma once

#include <vector>

#include "control_plane/control_records.pb.h"
#include "core/world/ids.h"

namespace tessera::control {

using IdRanges = google::protobuf::RepeatedPtrField<records::IdRange>;

// `ids` ascending, none twice.
IdRanges ToRanges(const std::vector<BodyId>& ids);
std::vector<BodyId> ToIds(const IdRanges& ranges);
// Those of `ids` that are in a range.
std::vector<BodyId> Within(const std::vector<BodyId>& ids, const IdRanges& ranges);
// False if it is not in it.
bool TakeOut(BodyId id, IdRanges& ranges);

}  // namespace tessera::control
