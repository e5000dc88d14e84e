#include "region_worker/wards.h"

#include <algorithm>

#include "region_worker/link_message.h"
#include "spdlog/spdlog.h"
#include "telemetry/logging.h"

namespace tessera::worker {
namespace {

// Between two requests for a whole state: messages that follow the gap are still coming in.
constexpr Duration kAskDistance = std::chrono::milliseconds(250);

}  // namespace

void Wards::Set(std::span<const RegionId> wards) {
  for (auto& [region, ward] : wards_) ward.wanted = false;
  for (const RegionId region : wards) {
    if (!wards_.contains(region)) Add(region);
    wards_.at(region).wanted = true;
  }
  std::erase_if(wards_, [](const auto& entry) { return !entry.second.wanted && !entry.second.dead; });
}

// Its log may have come before this order did, went nowhere, and its sender may have given up sending.
void Wards::Add(RegionId region) {
  wards_.try_emplace(region, region::Standby(region, catalog_));
  spdlog::info("ward region={}", region.value());
  links_.SendNow(region, Bare(LinkMessageKind::kLogAgain));
}

void Wards::OnLog(RegionId from, const LinkMessage& message, TimePoint now) {
  const auto found = wards_.find(from);
  if (found == wards_.end() || found->second.dead) return;
  Ward& ward = found->second;
  const net::PeerHandle link = links_.LinkTo(from);
  if (std::exchange(ward.link, link) != link) ward.partial.clear();  // what was begun over another link goes on nowhere
  if (ward.partial.size() + message.bytes.size() > kMaxLogBytes) {
    ward.partial.clear();
    metrics_.CountDropped(DropReason::kMalformed);
    return;
  }
  ward.partial.insert(ward.partial.end(), message.bytes.begin(), message.bytes.end());
  if (message.last) Take(from, ward, now);
}

void Wards::Take(RegionId from, Ward& ward, TimePoint now) {
  const absl::Status taken = ward.copy.Receive(ward.partial);
  ward.partial.clear();
  if (taken.ok()) {
    ward.acknowledged_at = now;
    ++ward.signs;
    links_.SendNow(from, Numbered(LinkMessageKind::kLogTaken, ward.copy.tick().value()));
    return;
  }
  metrics_.standby_gaps.Increment();
  if (now < ward.may_ask_at) return;
  ward.may_ask_at = now + kAskDistance;
  spdlog::warn("log not taken region={} reason={}", from.value(), telemetry::LogValue(std::string(taken.message())));
  links_.SendNow(from, Bare(LinkMessageKind::kLogAgain));
}

// Not before there is a copy: when a lease was given is told with that.
void Wards::OnLeaseAsk(RegionId from, std::uint64_t number, TimePoint now) {
  const auto ward = wards_.find(from);
  if (ward == wards_.end() || ward->second.dead || !ward->second.copy.whole()) return;
  ward->second.acknowledged_at = now;
  ++ward->second.signs;
  links_.SendNow(from, Numbered(LinkMessageKind::kLeaseGiven, number));
}

void Wards::DeclareDead(RegionId region) {
  const auto ward = wards_.find(region);
  if (ward == wards_.end()) return;
  ward->second.dead = true;
  ward->second.partial.clear();
}

std::vector<const region::Standby*> Wards::Dead() const {
  std::vector<const region::Standby*> copies;
  for (const auto& [region, ward] : wards_) {
    if (ward.dead && ward.copy.whole()) copies.push_back(&ward.copy);
  }
  return copies;
}

void Wards::Report(v1::WorkerReport& report) const {
  for (const auto& [region, ward] : wards_) {
    if (!ward.copy.whole()) continue;
    v1::StandbyStatus& standby = *report.add_standbys();
    standby.set_region(region.value());
    standby.set_incarnation(ward.copy.incarnation().value());
    standby.set_tick(ward.copy.tick().value());
    standby.set_signs(ward.signs);
  }
}

// A region that is wanted again is another life: it begins with a whole state.
void Wards::Forget() {
  for (auto it = wards_.begin(); it != wards_.end();) {
    const auto next = std::next(it);
    if (it->second.dead) {
      const bool wanted = it->second.wanted;
      const RegionId region = it->first;
      wards_.erase(it);
      if (wanted) Add(region);
    }
    it = next;
  }
}

}  // namespace tessera::worker
