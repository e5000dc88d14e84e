#include "core/region/inbox.h"

#include <algorithm>
#include <cassert>

#include "absl/strings/str_cat.h"
#include "core/region/frame_check.h"

namespace tessera::region {

Inbox::Inbox(std::span<const RegionId> neighbors, MapVersion map_version, const Catalog& catalog)
    : map_version_(map_version), catalog_(catalog) {
  for (const RegionId id : neighbors) links_.push_back({id, Tick(), {}, {}, {}});
}

Inbox::Link* Inbox::Find(RegionId id) {
  const auto it = std::find_if(links_.begin(), links_.end(), [&](const Link& link) { return link.id == id; });
  return it == links_.end() ? nullptr : &*it;
}

void Inbox::Expect(MapVersion version, std::span<const RegionId> neighbors) {
  expected_version_ = version;
  expected_neighbors_.assign(neighbors.begin(), neighbors.end());
  early_.clear();
}

std::vector<std::pair<RegionId, std::vector<std::uint8_t>>> Inbox::ChangeMap(MapVersion version,
                                                                             std::span<const RegionId> neighbors,
                                                                             Tick first, bool anew) {
  std::vector<Link> links;
  links.reserve(neighbors.size());
  for (const RegionId id : neighbors) {
    Link* old = anew ? nullptr : Find(id);
    links.push_back(old != nullptr ? std::move(*old) : Link{id, first, {}, {}, {}});
  }
  links_ = std::move(links);
  map_version_ = version;
  std::vector<std::pair<RegionId, std::vector<std::uint8_t>>> early;
  early.reserve(early_.size());
  for (auto& [from, bytes] : early_) early.emplace_back(from, std::move(bytes));
  Expect(MapVersion(), {});
  return early;
}

absl::Status Inbox::KeepEarly(RegionId from, std::span<const std::uint8_t> bytes) {
  if (!std::binary_search(expected_neighbors_.begin(), expected_neighbors_.end(), from)) {
    return absl::PermissionDeniedError(absl::StrCat("region ", from.value(), " is no neighbour by the next map"));
  }
  early_.emplace(from, std::vector<std::uint8_t>(bytes.begin(), bytes.end()));
  newest_commit_ = std::max(newest_commit_, expected_version_);
  return absl::OkStatus();
}

absl::Status Inbox::Put(RegionId from, std::span<const std::uint8_t> bytes, Tick now, const Frame** taken) {
  *taken = nullptr;
  const absl::StatusOr<FrameHeader> header = DecodeHeader(bytes);
  if (!header.ok()) return header.status();
  const bool early = expected_version_ != MapVersion() && header->map_version == expected_version_;
  Link* link = Find(from);
  if (link == nullptr && !early) {
    return absl::PermissionDeniedError(absl::StrCat("region ", from.value(), " is not a neighbour"));
  }
  if (header->sender != from) {
    return absl::PermissionDeniedError(
        absl::StrCat("a frame of region ", header->sender.value(), " from region ", from.value()));
  }
  if (early) return KeepEarly(from, bytes);
  if (header->map_version != map_version_) {
    return absl::FailedPreconditionError(
        absl::StrCat("map version ", header->map_version.value(), ", here it is ", map_version_.value()));
  }
  if (header->tick < now) return absl::OutOfRangeError(absl::StrCat("old tick ", header->tick.value()));
  if (header->tick < link->next) return absl::OkStatus();
  if (header->tick > link->next || header->tick > now + 1) {
    return absl::OutOfRangeError(absl::StrCat("tick ", header->tick.value(), " came before tick ", link->next.value(),
                                              "; here it is ", now.value()));
  }
  absl::StatusOr<Frame> frame = Decode(bytes, link->previous);
  if (!frame.ok()) return frame.status();
  if (absl::Status status = CheckFrame(*frame, catalog_); !status.ok()) return status;
  link->before_previous = std::move(link->previous);
  link->previous = frame->ghosts;
  link->next = header->tick + 1;
  newest_commit_ = std::max(newest_commit_, header->committed_version);
  link->frames.push_back(*std::move(frame));
  *taken = &link->frames.back();
  return absl::OkStatus();
}

void Inbox::Reject(RegionId from) {
  Link* link = Find(from);
  assert(link != nullptr && !link->frames.empty());
  link->next = link->frames.back().tick;
  link->frames.pop_back();
  link->previous = std::move(link->before_previous);
}

bool Inbox::Has(std::size_t neighbor, Tick tick) const {
  const Link& link = links_[neighbor];
  return !link.frames.empty() && link.frames.front().tick == tick;
}

Frame Inbox::Take(std::size_t neighbor, [[maybe_unused]] Tick tick) {
  assert(Has(neighbor, tick));
  Link& link = links_[neighbor];
  Frame frame = std::move(link.frames.front());
  link.frames.pop_front();
  return frame;
}

}  // namespace tessera::region
