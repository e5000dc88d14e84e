#include "control_plane/id_ranges.h"

#include <algorithm>

namespace tessera::control {
namespace {

bool Holds(const records::IdRange& range, BodyId id) {
  return range.first() <= id.value() && id.value() <= range.last();
}

}  // namespace

IdRanges ToRanges(const std::vector<BodyId>& ids) {
  IdRanges ranges;
  for (const BodyId id : ids) {
    if (ranges.empty() || ranges.rbegin()->last() + 1 != id.value()) ranges.Add()->set_first(id.value());
    ranges.rbegin()->set_last(id.value());
  }
  return ranges;
}

std::vector<BodyId> ToIds(const IdRanges& ranges) {
  std::vector<BodyId> ids;
  for (const records::IdRange& range : ranges) {
    for (std::uint64_t id = range.first(); id <= range.last(); ++id) ids.emplace_back(id);
  }
  return ids;
}

bool Contains(const IdRanges& ranges, BodyId id) {
  return std::any_of(ranges.begin(), ranges.end(), [&](const records::IdRange& range) { return Holds(range, id); });
}

std::vector<BodyId> Within(const std::vector<BodyId>& ids, const IdRanges& ranges) {
  std::vector<BodyId> within;
  std::copy_if(ids.begin(), ids.end(), std::back_inserter(within), [&](BodyId id) { return Contains(ranges, id); });
  return within;
}

bool TakeOut(const IdRanges& others, IdRanges& ranges) {
  IdRanges rest;
  const auto keep = [&](std::uint64_t first, std::uint64_t last) {
    rest.Add()->set_first(first);
    rest.rbegin()->set_last(last);
  };
  bool any = false;
  auto other = others.begin();
  for (const records::IdRange& range : ranges) {
    std::uint64_t next = range.first();
    while (other != others.end() && other->last() < next) ++other;
    for (; other != others.end() && other->first() <= range.last(); ++other) {
      any = true;
      if (next < other->first()) keep(next, other->first() - 1);
      next = other->last() + 1;
      if (next > range.last()) break;  // it may reach into the next one
    }
    if (next <= range.last()) keep(next, range.last());
  }
  ranges = std::move(rest);
  return any;
}

bool TakeOut(BodyId id, IdRanges& ranges) {
  const auto at = std::find_if(ranges.begin(), ranges.end(), [&](const auto& range) { return Holds(range, id); });
  if (at == ranges.end()) return false;
  const records::IdRange whole = *at;
  IdRanges next(ranges.begin(), at);
  if (whole.first() < id.value()) {
    next.Add()->set_first(whole.first());
    next.rbegin()->set_last(id.value() - 1);
  }
  if (id.value() < whole.last()) {
    next.Add()->set_first(id.value() + 1);
    next.rbegin()->set_last(whole.last());
  }
  next.MergeFrom(IdRanges(at + 1, ranges.end()));
  ranges = std::move(next);
  return true;
}

}  // namespace tessera::control
