#include "region_worker/core/link_table.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "net/protocol.h"

namespace tessera::worker {

void LinkTable::SetAddresses(std::span<const PeerAddress> peers, Actions& actions) {
  for (const PeerAddress& peer : peers) {
    const auto [found, is_new] = addresses_.try_emplace(peer.region, peer);
    if (!is_new && peer.incarnation < found->second.incarnation) continue;
    const bool another_life = !is_new && found->second.incarnation < peer.incarnation;
    found->second = peer;
    const auto partner = regions_.find(peer.region);
    if (partner == regions_.end()) continue;
    if (another_life) partner->second.kept.clear();
    if (partner->second.incarnation < peer.incarnation) {
      Cut(peer.region, partner->second, "the region has another worker", actions);
    }
  }
}

void LinkTable::SetPartners(std::span<const RegionId> partners, Actions& actions) {
  partners_ = {partners.begin(), partners.end()};
  for (auto& [region, partner] : regions_) {
    if (partners_.contains(region)) continue;
    partner.kept.clear();
    if (self_ < region) Cut(region, partner, "it is needed no more", actions);
  }
}

void LinkTable::Fence(RegionId region, Incarnation incarnation, Actions& actions) {
  Incarnation& highest = fenced_[region];
  highest = std::max(highest, incarnation);
  const auto found = regions_.find(region);
  if (found == regions_.end()) return;
  Partner& partner = found->second;
  const auto address = addresses_.find(region);
  const bool is_later = partner.link != 0 ? incarnation < partner.incarnation
                                          : address != addresses_.end() && incarnation < address->second.incarnation;
  if (is_later) return;
  partner.kept.clear();
  Cut(region, partner, "the region has died", actions);
}

void LinkTable::Cut(RegionId region, Partner& partner, std::string why, Actions& actions) {
  if (std::exchange(partner.link, 0) != 0) actions.emplace_back(CutLink{region, std::move(why)});
}

const PeerAddress* LinkTable::AddressOf(RegionId region) const {
  const auto found = addresses_.find(region);
  return found == addresses_.end() ? nullptr : &found->second;
}

bool LinkTable::Ended(RegionId region, Incarnation incarnation) const {
  const auto ended = fenced_.find(region);
  return ended != fenced_.end() && incarnation <= ended->second;
}

bool LinkTable::Dials(RegionId region) const {
  if (region <= self_ || LinkTo(region) != 0 || !partners_.contains(region)) return false;
  const PeerAddress* address = AddressOf(region);
  return address != nullptr && !Ended(region, address->incarnation);
}

absl::Status LinkTable::Admit(RegionId region, Incarnation incarnation) const {
  const PeerAddress* address = AddressOf(region);
  if (address == nullptr && !partners_.contains(region)) {
    return absl::FailedPreconditionError(absl::StrCat("region ", region.value(), " is not expected here"));
  }
  if (Ended(region, incarnation)) {
    return absl::FailedPreconditionError(absl::StrCat("incarnation ", incarnation.value(), " has been declared dead"));
  }
  if (address != nullptr && incarnation < address->incarnation) {
    return absl::FailedPreconditionError(
        absl::StrCat("incarnation ", incarnation.value(), " is fenced by ", address->incarnation.value()));
  }
  return absl::OkStatus();
}

void LinkTable::Up(RegionId region, Incarnation incarnation, TimePoint now, Actions& actions) {
  Partner& partner = regions_[region];
  partner.link = ++links_;
  partner.incarnation = incarnation;
  partner.heard = now;
  for (const Message& frame : partner.kept) actions.emplace_back(SendMessage{region, frame});
  actions.emplace_back(FlushLinks{});
}

void LinkTable::Down(RegionId region) {
  if (const auto found = regions_.find(region); found != regions_.end()) found->second.link = 0;
}

void LinkTable::Heard(RegionId region, TimePoint now) { regions_[region].heard = now; }

LinkTable::LinkNumber LinkTable::LinkTo(RegionId region) const {
  const auto found = regions_.find(region);
  return found == regions_.end() ? 0 : found->second.link;
}

std::optional<TimePoint> LinkTable::HeardFrom(RegionId region) const {
  const auto found = regions_.find(region);
  if (found == regions_.end() || found->second.heard == TimePoint()) return std::nullopt;
  return found->second.heard;
}

std::vector<RegionId> LinkTable::Linked() const {
  std::vector<RegionId> linked;
  for (const auto& [region, partner] : regions_) {
    if (partner.link != 0) linked.push_back(region);
  }
  return linked;
}

bool LinkTable::AllLinked() const {
  return std::ranges::all_of(partners_, [this](RegionId partner) { return LinkTo(partner) != 0; });
}

void LinkTable::Send(RegionId to, region::Bytes message, Actions& actions) const {
  if (LinkTo(to) != 0) Send(to, std::make_shared<const region::Bytes>(std::move(message)), actions);
}

void LinkTable::Send(RegionId to, const Message& message, Actions& actions) const {
  if (LinkTo(to) != 0) actions.emplace_back(SendMessage{to, message});
}

void LinkTable::SendFrames(std::vector<region::OutgoingFrame> frames, Actions& actions) {
  for (region::OutgoingFrame& frame : frames) {
    frame_bytes_ += frame.bytes.size();
    if (frame.bytes.size() > net::kMaxFrameBytes) {
      health_ = absl::ResourceExhaustedError(absl::StrCat("frame of ", frame.bytes.size(), " bytes for region ",
                                                          frame.to.value(), ": at most ", net::kMaxFrameBytes));
    }
    Partner& partner = regions_[frame.to];
    if (partner.kept.size() == kFramesKept) partner.kept.erase(partner.kept.begin());
    partner.kept.push_back(std::make_shared<const region::Bytes>(std::move(frame.bytes)));
    if (partner.link != 0) actions.emplace_back(SendMessage{frame.to, partner.kept.back()});
  }
  actions.emplace_back(FlushLinks{});
}

void LinkTable::RepeatFrames(Actions& actions) const {
  for (const auto& [region, partner] : regions_) {
    if (partner.link != 0 && !partner.kept.empty()) actions.emplace_back(SendMessage{region, partner.kept.back()});
  }
  actions.emplace_back(FlushLinks{});
}

void LinkTable::ForgetFrames() {
  for (auto& [region, partner] : regions_) partner.kept.clear();
}

}  // namespace tessera::worker
