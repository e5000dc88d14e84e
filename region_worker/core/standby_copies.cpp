#include "region_worker/core/standby_copies.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "region_worker/core/reason.h"

namespace tessera::worker {
namespace {

// Between two requests for a whole state: messages that follow the gap are still coming in.
constexpr Duration kAskDistance = std::chrono::milliseconds(250);

}  // namespace

void StandbyCopies::Set(std::span<const RegionId> primaries, TimePoint now, const LinkTable& links, Actions& actions) {
  for (const RegionId region : primaries) {
    const auto known = primaries_.find(region);
    const bool retired = known != primaries_.end() && !known->second.wanted && !known->second.dead;
    if (known == primaries_.end() || retired) Add(region, links, actions);
    Primary& primary = primaries_.at(region);
    // A retired copy missed something: another whole state takes its place. Until then it may be all that there is.
    if (retired) primary.stale = primary.copy.whole();
    primary.wanted = true;
  }
  for (auto& [region, primary] : primaries_) {
    if (!primary.wanted || std::ranges::find(primaries, region) != primaries.end()) continue;
    primary.wanted = false;
    primary.retired_at = now;
    primary.partial.clear();
  }
}

void StandbyCopies::Expire(TimePoint now) {
  std::erase_if(primaries_, [now](const auto& entry) {
    const Primary& primary = entry.second;
    return !primary.wanted && !primary.dead && now >= primary.retired_at + kRetiredFor;
  });
}

// Its log may have come before this order did, went nowhere, and its sender may have stopped sending.
void StandbyCopies::Add(RegionId region, const LinkTable& links, Actions& actions) {
  primaries_.try_emplace(region, region::StandbyCopy(region, catalog_));
  LogInfo(actions, absl::StrCat("primary region=", region.value()));
  links.Send(region, Bare(LinkMessageKind::kLogAgain), actions);
}

void StandbyCopies::OnLog(RegionId from, const LinkMessage& message, TimePoint now, const LinkTable& links,
                          Actions& actions) {
  const auto found = primaries_.find(from);
  if (found == primaries_.end() || found->second.dead || !found->second.wanted) return;
  Primary& primary = found->second;
  const LinkTable::LinkNumber link = links.LinkTo(from);
  // A message that was begun over another link is never completed.
  if (std::exchange(primary.link, link) != link) primary.partial.clear();
  if (primary.partial.size() + message.bytes.size() > kMaxLogBytes) {
    primary.partial.clear();
    ++gaps_;
    return;
  }
  primary.partial.insert(primary.partial.end(), message.bytes.begin(), message.bytes.end());
  if (message.last) Take(from, primary, now, links, actions);
}

void StandbyCopies::Take(RegionId from, Primary& primary, TimePoint now, const LinkTable& links, Actions& actions) {
  const Tick before = primary.copy.tick();
  const absl::Status taken = primary.copy.Receive(primary.partial);
  primary.partial.clear();
  if (taken.ok()) {
    if (primary.stale && primary.copy.tick() <= before) return;  // it had this state already
    primary.stale = false;
    primary.acknowledged_at = now;
    ++primary.signs;
    links.Send(from, Numbered(LinkMessageKind::kLogTaken, primary.copy.tick().value()), actions);
    return;
  }
  ++gaps_;
  if (now < primary.may_ask_at) return;
  primary.may_ask_at = now + kAskDistance;
  LogWarning(actions, absl::StrCat("log not taken region=", from.value(), Reason(taken)));
  links.Send(from, Bare(LinkMessageKind::kLogAgain), actions);
}

// Not before there is a copy: when a lease was given is reported with that.
void StandbyCopies::OnLeaseAsk(RegionId from, std::uint64_t number, TimePoint now, const LinkTable& links,
                               Actions& actions) {
  const auto primary = primaries_.find(from);
  if (primary == primaries_.end() || primary->second.dead || !primary->second.wanted) return;
  if (!primary->second.copy.whole() || primary->second.stale) return;
  primary->second.acknowledged_at = now;
  ++primary->second.signs;
  links.Send(from, Numbered(LinkMessageKind::kLeaseGiven, number), actions);
}

void StandbyCopies::DeclareDead(RegionId region) {
  const auto primary = primaries_.find(region);
  if (primary == primaries_.end()) return;
  primary->second.dead = true;
  primary->second.partial.clear();
}

std::vector<const region::StandbyCopy*> StandbyCopies::Dead() const {
  std::vector<const region::StandbyCopy*> copies;
  for (const auto& [region, primary] : primaries_) {
    if (primary.dead && primary.copy.whole()) copies.push_back(&primary.copy);
  }
  return copies;
}

std::vector<const region::StandbyCopy*> StandbyCopies::Whole() const {
  std::vector<const region::StandbyCopy*> copies;
  for (const auto& [region, primary] : primaries_) {
    if (primary.copy.whole()) copies.push_back(&primary.copy);
  }
  return copies;
}

std::optional<TimePoint> StandbyCopies::AcknowledgedAt(RegionId primary) const {
  const auto found = primaries_.find(primary);
  if (found == primaries_.end()) return std::nullopt;
  return found->second.acknowledged_at;
}

void StandbyCopies::Report(v1::WorkerReport& report) const {
  for (const auto& [region, primary] : primaries_) {
    if (!primary.copy.whole() || !primary.wanted || primary.stale) continue;
    v1::StandbyStatus& copy = *report.add_standby_copies();
    copy.set_region(region.value());
    copy.set_incarnation(primary.copy.incarnation().value());
    copy.set_tick(primary.copy.tick().value());
    copy.set_signs(primary.signs);
  }
}

// A region that is wanted again is another life: its copy begins with a whole state.
void StandbyCopies::Forget(const LinkTable& links, Actions& actions) {
  for (auto it = primaries_.begin(); it != primaries_.end();) {
    const auto next = std::next(it);
    if (it->second.dead) {
      const bool wanted = it->second.wanted;
      const RegionId region = it->first;
      primaries_.erase(it);
      if (wanted) Add(region, links, actions);
    }
    it = next;
  }
}

}  // namespace tessera::worker
