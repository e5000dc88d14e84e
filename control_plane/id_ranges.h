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

// `ids` ascend, none twice.
IdRanges ToRanges(const std::vector<BodyId>& ids);
std::vector<BodyId> ToIds(const IdRanges& ranges);
bool Contains(const IdRanges& ranges, BodyId id);
// The ids that are in a range, in their order.
std::vector<BodyId> Within(const std::vector<BodyId>& ids, const IdRanges& ranges);
// Removes the id. False if it is in no range.
bool TakeOut(BodyId id, IdRanges& ranges);
// The same for `others`, which ascend as `ranges` do.
bool TakeOut(const IdRanges& others, IdRanges& ranges);

}  // namespace tessera::control
