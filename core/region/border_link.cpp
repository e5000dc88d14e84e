#include "core/region/border_link.h"

#include <algorithm>
#include <cassert>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/region/ascends.h"
#include "core/region/frame_check.h"
#include "core/region/settings.h"

namespace tessera::region {
namespace {

// Only sleepers are known to stay as they are.
absl::Status CheckPromised(const BorderFrame& frame) {
  if (frame.stamp.promised == 0) return absl::OkStatus();
  if (frame.stamp.promised > kMaxPromised) return absl::InvalidArgumentError("promises too many frames");
  const bool quiet = frame.impulses.empty() && frame.grants.empty() && frame.acknowledgements.empty() &&
                     frame.late_corrections.empty() && frame.inputs.empty();
  const auto sleeps = [](const GhostRecord& ghost) { return ghost.state.asleep; };
  if (quiet && std::all_of(frame.ghosts.begin(), frame.ghosts.end(), sleeps)) return absl::OkStatus();
  return absl::InvalidArgumentError("promises more than sleepers");
}

}  // namespace

absl::Status BorderLink::Put(const BorderFrameHeader& header, std::span<const std::uint8_t> bytes,
                             const Catalog& catalog, Tick now, const BorderFrame** taken) {
  const FrameStamp& theirs = header.stamp;
  if (theirs.outages < stamp_.peer_outages) return absl::OkStatus();
  if (theirs.outages > stamp_.peer_outages) {
    stamp_.peer_outages = theirs.outages;
    up_ = false;
    Forget();
  }
  if (theirs.peer_outages != stamp_.outages) return absl::OkStatus();  // it has not heard of ours yet
  if (theirs.reconnect) {
    TakeReconnect(header, now);
    return absl::OkStatus();
  }
  // The neighbour's link may have come up a little earlier.
  const bool early = !up_ && up_at_ != Tick() && theirs.number == 0;
  if (!up_ && !early) return absl::OkStatus();
  return PutFrame(header, bytes, catalog, now, taken);
}

void BorderLink::TakeReconnect(const BorderFrameHeader& header, Tick now) {
  if (header.tick.value() > now.value() + kMaxTicksAhead || header.stamp.up_at.value() > now.value() + kMaxTicksAhead) {
    return;
  }
  if (up_) {
    // The neighbour has missed the tick; or it waits, by way of others, for this side, which waits for it.
    if (here_ == 0 && (up_at_ < header.tick || ++reconnects_ > kMaxReconnects)) TakeDown();
  } else if (header.tick > now + kFarBehind) {
    adopt_ = std::max(adopt_, header.tick);
  } else if (now > header.tick + kFarBehind) {
    return;  // it adopts this side's first
  } else if (peer_ < self_) {
    if (up_at_ != Tick()) return;
    up_at_ = std::max(now, header.tick) + kReconnectDelayTicks;
    reconnect_in_ = 0;
  } else if (header.stamp.up_at > now) {
    up_at_ = header.stamp.up_at;
  }
}

absl::Status BorderLink::PutFrame(const BorderFrameHeader& header, std::span<const std::uint8_t> bytes,
                                  const Catalog& catalog, Tick now, const BorderFrame** taken) {
  const std::uint64_t number = header.stamp.number;
  if (number < here_) return absl::OkStatus();
  if (number != ComesNext() || number > std::max(stamp_.number, silent_end_)) {
    return absl::OutOfRangeError(absl::StrCat("tick ", header.tick.value(), " came before its time: frame ", number,
                                              " of the border, after ", here_, "; here it is tick ", now.value()));
  }
  const bool first = here_ == 0;
  if (!first && header.tick - newest_ < static_cast<std::int64_t>(number + 1 - here_)) {
    return absl::OutOfRangeError(
        absl::StrCat("tick ", header.tick.value(), " in frame ", number, ", after tick ", newest_.value()));
  }
  if (header.tick.value() > now.value() + kMaxTicksAhead) {
    return absl::OutOfRangeError(absl::StrCat("tick ", header.tick.value(), ", here it is ", now.value()));
  }
  absl::StatusOr<BorderFrame> frame = Decode(bytes, previous_);
  if (!frame.ok()) return frame.status();
  if (absl::Status status = CheckFrame(*frame, catalog); !status.ok()) return status;
  if (absl::Status status = CheckPromised(*frame); !status.ok()) return status;
  before_previous_ = std::exchange(previous_, frame->ghosts);
  before_.number = here_;
  before_.promised = promised_;
  before_newest_ = newest_;
  // Frames that were promised in between and not taken yet would be forgotten with the frame that promised them.
  for (std::uint64_t i = std::max(here_, needed_); i < number; ++i) frames_.push_back(Promised(i, before_previous_));
  here_ = number + 1;
  promised_ = header.stamp.promised;
  newest_ = header.tick;
  while (!news_.empty() && news_.front() < number) news_.pop_front();
  frames_.push_back(*std::move(frame));
  *taken = &frames_.back();
  return absl::OkStatus();
}

void BorderLink::Reject() {
  assert(!frames_.empty());
  here_ = before_.number;
  promised_ = before_.promised;
  newest_ = before_newest_;
  previous_ = std::move(before_previous_);
  while (!frames_.empty() && frames_.back().stamp.number >= here_) frames_.pop_back();
}

std::uint64_t BorderLink::ComesNext() const {
  const std::uint64_t promised_end = here_ + promised_;
  return promised_ == 0 || news_.empty() ? promised_end : std::min(promised_end, std::max(news_.front() + 1, here_));
}

bool BorderLink::Ready() const {
  if (!up_) return true;
  if (!frames_.empty() && frames_.front().stamp.number == needed_) return true;
  return here_ > 0 && needed_ >= here_ && needed_ < ComesNext();
}

BorderFrame BorderLink::Take(Tick now) {
  assert(Ready());
  BorderFrame frame;
  if (!up_) {
    frame.tick = std::exchange(adopt_, Tick());
    return frame;
  }
  if (!frames_.empty() && frames_.front().stamp.number == needed_) {
    frame = std::move(frames_.front());
    frames_.pop_front();
    if (frame.tick != now) {
      desync_score_ += kDesyncPenalty;
    } else if (desync_score_ > 0) {
      --desync_score_;
    }
    // The neighbour has news: own frames that were promised after this number come after all.
    if (frame.stamp.promised == 0) silent_end_ = std::min(silent_end_, needed_ + 1);
  } else {
    frame = Promised(needed_, previous_);
  }
  ++needed_;
  return frame;
}

// A frame that the newest frame promises, whose ghosts are `ghosts`.
BorderFrame BorderLink::Promised(std::uint64_t number, const std::vector<GhostRecord>& ghosts) const {
  BorderFrame frame;
  frame.sender = peer_;
  frame.stamp.number = number;
  frame.stamp.promised = 1;  // no news
  frame.tick = newest_ + (number + 1 - here_);
  frame.ghosts = ghosts;
  return frame;
}

BorderLink::Duty BorderLink::DutyNow(Tick now) {
  if (up_ && desync_score_ > kMaxDesyncScore) TakeDown();
  if (up_) {
    if (Speaks()) return Duty::kFrame;
    ++stamp_.number;
    return Duty::kNothing;
  }
  if (up_at_ != Tick() && now == up_at_) {
    up_ = true;
    return Duty::kFirstFrame;
  }
  if (up_at_ != Tick() && now > up_at_) CountOutage();  // it jumped over it
  if (reconnect_in_ > 0) {
    --reconnect_in_;
    return Duty::kNothing;
  }
  reconnect_in_ = kReconnectIntervalTicks - 1;
  return Duty::kReconnect;
}

FrameStamp BorderLink::StampFrame(std::uint32_t promised) {
  FrameStamp stamp = stamp_;
  stamp.promised = promised;
  if (promised > 0) {
    silent_end_ = stamp_.number + 1 + promised;
  } else {
    news_.push_back(stamp_.number);
  }
  ++stamp_.number;
  return stamp;
}

FrameStamp BorderLink::StampReconnect() const {
  FrameStamp stamp = stamp_;
  stamp.reconnect = true;
  stamp.up_at = peer_ < self_ ? up_at_ : Tick();
  return stamp;
}

void BorderLink::TakeDown() {
  if (!up_) return;
  up_ = false;
  CountOutage();
}

void BorderLink::Jumped() {
  if (!up_ && up_at_ != Tick()) CountOutage();
}

// The other side must hear of this outage.
void BorderLink::CountOutage() {
  ++stamp_.outages;
  Forget();
}

void BorderLink::Forget() {
  up_at_ = adopt_ = Tick();
  desync_score_ = 0;
  reconnects_ = 0;
  reconnect_in_ = 0;
  stamp_.number = here_ = needed_ = silent_end_ = 0;
  promised_ = 0;
  frames_.clear();
  news_.clear();
  previous_.clear();
  before_previous_.clear();
}

void BorderLink::Validate() const {
  assert(up_ || up_at_ != Tick() || frames_.empty());
  assert(Ascends(frames_, [](const BorderFrame& frame) { return frame.stamp.number; }));
  assert(Ascends(news_));
}

}  // namespace tessera::region
