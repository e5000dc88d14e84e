#include "core/region/borders.h"

#include <algorithm>
#include <cassert>

#include "absl/strings/str_cat.h"
#include "core/region/ascends.h"
#include "core/region/settings.h"

namespace tessera::region {
namespace {

// Frames by the next map that are kept: a neighbour that this region promises to is so far ahead at most, and repeats
// some.
constexpr std::size_t kMaxEarly = 2 * kMaxPromised;

}  // namespace

Borders::Borders(RegionId self, std::span<const RegionId> neighbors, MapVersion map_version, const Catalog& catalog)
    : self_(self), map_version_(map_version), catalog_(catalog) {
  borders_.reserve(neighbors.size());
  for (const RegionId id : neighbors) borders_.push_back({BorderLink(self, id), {}});
}

std::ptrdiff_t Borders::IndexOf(RegionId id) const {
  const auto it = std::ranges::find_if(borders_, [id](const Border& border) { return border.link.peer() == id; });
  return it == borders_.end() ? -1 : it - borders_.begin();
}

bool Borders::Ready() const {
  return std::ranges::all_of(borders_, [](const Border& border) { return border.link.Ready(); });
}

std::vector<RegionId> Borders::WaitingFor() const {
  std::vector<RegionId> missing;
  for (const Border& border : borders_) {
    if (!border.link.Ready()) missing.push_back(border.link.peer());
  }
  return missing;
}

Borders::TakenFrames Borders::Take(Tick now) {
  TakenFrames taken{{}, now};
  taken.frames.reserve(borders_.size());
  for (Border& border : borders_) {
    taken.frames.push_back(border.link.Take(now));
    taken.tick = std::max(taken.tick, taken.frames.back().tick);
  }
  if (taken.tick != now) {
    for (Border& border : borders_) border.link.Jumped();
  }
  return taken;
}

void Borders::TakeDown(RegionId neighbor) {
  if (const std::ptrdiff_t at = IndexOf(neighbor); at >= 0) borders_[static_cast<std::size_t>(at)].link.TakeDown();
}

bool Borders::IsUp(RegionId neighbor) const {
  const std::ptrdiff_t at = IndexOf(neighbor);
  return at >= 0 && IsUp(static_cast<std::size_t>(at));
}

std::vector<RegionId> Borders::LinksUp() const {
  std::vector<RegionId> up;
  up.reserve(borders_.size());
  for (const Border& border : borders_) {
    if (border.link.up()) up.push_back(border.link.peer());
  }
  return up;
}

Tick Borders::newest() const {
  Tick newest;
  for (const Border& border : borders_) newest = std::max(newest, border.link.newest());
  return newest;
}

bool Borders::Speaks(RegionId neighbor) const {
  const std::ptrdiff_t at = IndexOf(neighbor);
  return at >= 0 && borders_[static_cast<std::size_t>(at)].link.Speaks();
}

Borders::SentFrame Borders::SendFrame(std::size_t neighbor, BorderFrame frame, std::uint32_t promised) {
  Border& border = borders_[neighbor];
  frame.stamp = border.link.StampFrame(promised);
  SentFrame sent{{border.link.peer(), Encode(frame, border.sent)}, frame.stamp.number};
  border.sent = std::move(frame.ghosts);
  return sent;
}

OutgoingFrame Borders::SendReconnect(std::size_t neighbor, BorderFrame request) {
  const BorderLink& link = borders_[neighbor].link;
  request.stamp = link.StampReconnect();
  return {link.peer(), Encode(request, {})};
}

void Borders::Expect(MapVersion version, std::span<const RegionId> neighbors) {
  expected_version_ = version;
  expected_neighbors_.assign(neighbors.begin(), neighbors.end());
  early_.clear();
}

std::vector<std::pair<RegionId, Bytes>> Borders::ChangeMap(MapVersion version, std::span<const RegionId> neighbors,
                                                           bool anew) {
  std::vector<Border> borders;
  borders.reserve(neighbors.size());
  for (const RegionId id : neighbors) {
    const std::ptrdiff_t old = anew ? -1 : IndexOf(id);
    borders.push_back(old >= 0 ? std::move(borders_[static_cast<std::size_t>(old)])
                               : Border{BorderLink(self_, id), {}});
  }
  borders_ = std::move(borders);
  map_version_ = version;
  std::vector<std::pair<RegionId, Bytes>> early;
  for (auto& [from, frames] : early_) {
    for (Bytes& bytes : frames) early.emplace_back(from, std::move(bytes));
  }
  Expect(MapVersion(), {});
  return early;
}

// A region that changed its map says that it is committed; one that is to join sends its first frames before that.
absl::Status Borders::KeepEarly(RegionId from, MapVersion committed, std::span<const std::uint8_t> bytes) {
  if (!std::binary_search(expected_neighbors_.begin(), expected_neighbors_.end(), from)) {
    return absl::PermissionDeniedError(absl::StrCat("region ", from.value(), " is no neighbour by the next map"));
  }
  std::vector<Bytes>& frames = early_[from];
  if (frames.size() >= kMaxEarly) {
    return absl::ResourceExhaustedError(absl::StrCat("region ", from.value(), " is far ahead by the next map"));
  }
  frames.emplace_back(bytes.begin(), bytes.end());
  newest_commit_ = std::max(newest_commit_, committed);
  return absl::OkStatus();
}

absl::Status Borders::Put(RegionId from, std::span<const std::uint8_t> bytes, Tick now, const BorderFrame** taken) {
  *taken = nullptr;
  const absl::StatusOr<BorderFrameHeader> header = DecodeHeader(bytes);
  if (!header.ok()) return header.status();
  const bool early = expected_version_ != MapVersion() && header->map_version == expected_version_;
  const std::ptrdiff_t border = IndexOf(from);
  if (border < 0 && !early) {
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
  BorderLink& link = borders_[static_cast<std::size_t>(border)].link;
  if (absl::Status status = link.Put(*header, bytes, catalog_, now, taken); !status.ok()) return status;
  newest_commit_ = std::max(newest_commit_, header->committed_version);
  return absl::OkStatus();
}

void Borders::Reject(RegionId from) {
  const std::ptrdiff_t border = IndexOf(from);
  assert(border >= 0);
  borders_[static_cast<std::size_t>(border)].link.Reject();
}

void Borders::Validate() const {
  assert(Ascends(borders_, [](const Border& border) { return border.link.peer(); }));
  for (const Border& border : borders_) border.link.Validate();
}

}  // namespace tessera::region
