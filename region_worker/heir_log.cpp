#include "region_worker/heir_log.h"

#include "region_worker/link_message.h"
#include "spdlog/spdlog.h"

namespace tessera::worker {

void HeirLog::SetHeir(RegionId heir) {
  if (heir == heir_) return;
  End();
  heir_ = heir;
  jammed_ = false;
  if (heir_ == RegionId()) {
    lease_.Release();
    region_.SetStandby(false);
  } else {
    lease_.Require();
    region_.SetStandby(true);
  }
  spdlog::info("heir region={}", heir_.value());
}

void HeirLog::Begin() {
  region_.SetStandby(true);
  sent_.clear();
  taken_.reset();
}

void HeirLog::End() {
  link_ = {};
  sent_.clear();
  taken_.reset();
}

void HeirLog::Follow(TimePoint now) {
  if (heir_ == RegionId()) return;
  const net::PeerHandle link = links_.LinkTo(heir_);
  if (link != link_) {
    End();
    jammed_ = false;
    link_ = link;
    if (link != net::PeerHandle()) Begin();
  }
  if (!jammed_ && !sent_.empty() && now - sent_.front().at > kJam) {
    spdlog::warn("heir takes nothing region={} tick={}", heir_.value(), sent_.front().tick.value());
    taken_.reset();
    jammed_ = true;
  }
  metrics_.unprotected.Set(unprotected() ? 1 : 0);
}

void HeirLog::Send(std::span<const std::uint8_t> log, Tick tick, TimePoint now) {
  if (log.empty() || link_ == net::PeerHandle() || jammed_) return;
  for (const auto& piece : LogPieces(log)) {
    if (!links_.SendNow(heir_, piece)) return;  // the link is about to end
  }
  sent_.push_back({tick, now});
  bytes_sent_ += log.size();
  metrics_.standby_bytes.Increment(static_cast<double>(log.size()));
}

void HeirLog::OnTaken(RegionId from, Tick tick) {
  if (from != heir_ || sent_.empty() || tick < sent_.front().tick) return;
  while (!sent_.empty() && sent_.front().tick <= tick) {
    lease_.Renewed(sent_.front().at);
    sent_.pop_front();
  }
  if (jammed_) {
    if (!sent_.empty()) return;
    jammed_ = false;  // it has caught up
    Begin();
    return;
  }
  if (!taken_) spdlog::info("protected heir={} tick={}", heir_.value(), tick.value());
  taken_ = tick;
  region_.LogAcknowledged(tick);
}

void HeirLog::OnAgain(RegionId from) {
  if (from != heir_ || link_ == net::PeerHandle()) return;
  spdlog::warn("heir has a gap region={}", heir_.value());
  jammed_ = false;
  Begin();
}

}  // namespace tessera::worker
