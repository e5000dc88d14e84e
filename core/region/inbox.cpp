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

absl::Status Inbox::Put(RegionId from, std::span<const std::uint8_t> bytes, Tick now, const Frame** taken) {
  *taken = nullptr;
  Link* link = Find(from);
  if (link == nullptr) return absl::PermissionDeniedError(absl::StrCat("region ", from.value(), " is not a neighbour"));
  const absl::StatusOr<FrameHeader> header = DecodeHeader(bytes);
  if (!header.ok()) return header.status();
  if (header->sender != from) {
    return absl::PermissionDeniedError(
        absl::StrCat("a frame of region ", header->sender.value(), " from region ", from.value()));
  }
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
