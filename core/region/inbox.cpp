#include "core/region/inbox.h"

#include <algorithm>
#include <cassert>

#include "absl/strings/str_cat.h"
#include "core/region/settings.h"

namespace tessera::region {
namespace {

// Frames by the next map: a neighbour that this region vouches for is so far ahead at most, and repeats some.
constexpr std::size_t kMaxEarly = 2 * kMaxVouched;

}  // namespace

Inbox::Inbox(RegionId self, std::span<const RegionId> neighbors, MapVersion map_version, const Catalog& catalog)
    : self_(self), map_version_(map_version), catalog_(catalog) {
  links_.reserve(neighbors.size());
  for (const RegionId id : neighbors) links_.emplace_back(self, id);
}

Link* Inbox::Find(RegionId id) {
  const auto it = std::find_if(links_.begin(), links_.end(), [&](const Link& link) { return link.peer() == id; });
  return it == links_.end() ? nullptr : &*it;
}

void Inbox::Expect(MapVersion version, std::span<const RegionId> neighbors) {
  expected_version_ = version;
  expected_neighbors_.assign(neighbors.begin(), neighbors.end());
  early_.clear();
}

std::vector<std::pair<RegionId, std::vector<std::uint8_t>>> Inbox::ChangeMap(MapVersion version,
                                                                             std::span<const RegionId> neighbors,
                                                                             bool anew) {
  std::vector<Link> links;
  links.reserve(neighbors.size());
  for (const RegionId id : neighbors) {
    Link* old = anew ? nullptr : Find(id);
    links.push_back(old != nullptr ? std::move(*old) : Link(self_, id));
  }
  links_ = std::move(links);
  map_version_ = version;
  std::vector<std::pair<RegionId, std::vector<std::uint8_t>>> early;
  for (auto& [from, frames] : early_) {
    for (std::vector<std::uint8_t>& bytes : frames) early.emplace_back(from, std::move(bytes));
  }
  Expect(MapVersion(), {});
  return early;
}

// A region that changed its map says that it is committed; one that is to join sends its first frames before that.
absl::Status Inbox::KeepEarly(RegionId from, MapVersion committed, std::span<const std::uint8_t> bytes) {
  if (!std::binary_search(expected_neighbors_.begin(), expected_neighbors_.end(), from)) {
    return absl::PermissionDeniedError(absl::StrCat("region ", from.value(), " is no neighbour by the next map"));
  }
  std::vector<std::vector<std::uint8_t>>& frames = early_[from];
  if (frames.size() >= kMaxEarly) {
    return absl::ResourceExhaustedError(absl::StrCat("region ", from.value(), " is far ahead by the next map"));
  }
  frames.emplace_back(bytes.begin(), bytes.end());
  newest_commit_ = std::max(newest_commit_, committed);
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
  if (early) return KeepEarly(from, header->committed_version, bytes);
  if (header->map_version != map_version_) {
    return absl::FailedPreconditionError(
        absl::StrCat("map version ", header->map_version.value(), ", here it is ", map_version_.value()));
  }
  if (absl::Status status = link->Put(*header, bytes, catalog_, now, taken); !status.ok()) return status;
  newest_commit_ = std::max(newest_commit_, header->committed_version);
  return absl::OkStatus();
}

void Inbox::Reject(RegionId from) {
  Link* link = Find(from);
  assert(link != nullptr);
  link->Reject();
}

}  // namespace tessera::region
