#include "region_worker/core/standby_log.h"

#include "absl/strings/str_cat.h"
#include "region_worker/core/link_message.h"

namespace tessera::worker {

void StandbyLog::SetStandby(RegionId standby, region::Region& region, Actions& actions) {
  if (standby == standby_) return;
  End();
  standby_ = standby;
  jammed_ = false;
  if (standby_ == RegionId()) {
    lease_.Release();
    region.SetStandby(false);
  } else {
    lease_.Require();
    region.SetStandby(true);
  }
  LogInfo(actions, absl::StrCat("standby region=", standby_.value()));
}

void StandbyLog::Begin(region::Region& region) {
  region.SetStandby(true);
  sent_.clear();
  taken_.reset();
}

void StandbyLog::End() {
  link_ = 0;
  sent_.clear();
  taken_.reset();
}

void StandbyLog::Follow(const LinkTable& links, TimePoint now, region::Region& region, Actions& actions) {
  if (standby_ == RegionId()) return;
  const LinkTable::LinkNumber link = links.LinkTo(standby_);
  if (link != link_) {
    End();
    jammed_ = false;
    link_ = link;
    if (link != 0) Begin(region);
  }
  if (!jammed_ && !sent_.empty() && now - sent_.front().at > kJam) {
    LogWarning(actions,
               absl::StrCat("standby takes nothing region=", standby_.value(), " tick=", sent_.front().tick.value()));
    taken_.reset();
    jammed_ = true;
  }
}

void StandbyLog::Send(std::span<const std::uint8_t> log, Tick tick, TimePoint now, const LinkTable& links,
                      Actions& actions) {
  if (log.empty() || link_ == 0 || jammed_) return;
  for (region::Bytes& piece : LogPieces(log)) links.Send(standby_, std::move(piece), actions);
  sent_.push_back({tick, now});
  bytes_sent_ += log.size();
}

void StandbyLog::OnTaken(RegionId from, Tick tick, region::Region& region, Actions& actions) {
  if (from != standby_ || sent_.empty() || tick < sent_.front().tick) return;
  while (!sent_.empty() && sent_.front().tick <= tick) {
    lease_.Renewed(sent_.front().at);
    sent_.pop_front();
  }
  if (jammed_) {
    if (!sent_.empty()) return;
    jammed_ = false;  // it has caught up
    Begin(region);
    return;
  }
  if (!taken_) LogInfo(actions, absl::StrCat("protected standby=", standby_.value(), " tick=", tick.value()));
  taken_ = tick;
  region.LogAcknowledged(tick);
}

void StandbyLog::OnAgain(RegionId from, region::Region& region, Actions& actions) {
  if (from != standby_ || link_ == 0) return;
  LogWarning(actions, absl::StrCat("standby has a gap region=", standby_.value()));
  jammed_ = false;
  Begin(region);
}

}  // namespace tessera::worker
