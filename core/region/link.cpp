#include "core/region/link.h"

#include <algorithm>
#include <cassert>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/region/frame_check.h"
#include "core/region/settings.h"

namespace tessera::region {
namespace {

// Only of sleepers can be known that they stay as they are.
absl::Status CheckVouched(const Frame& frame) {
  if (frame.stamp.vouched == 0) return absl::OkStatus();
  if (frame.stamp.vouched > kMaxVouched) return absl::InvalidArgumentError("vouches for too many frames");
  const bool quiet = frame.impulses.empty() && frame.grants.empty() && frame.confirmations.empty() &&
                     frame.late_corrections.empty() && frame.inputs.empty();
  const auto sleeps = [](const GhostRecord& ghost) { return ghost.state.asleep; };
  if (quiet && std::all_of(frame.ghosts.begin(), frame.ghosts.end(), sleeps)) return absl::OkStatus();
  return absl::InvalidArgumentError("vouches for more than sleepers");
}

}  // namespace

absl::Status Link::Put(const FrameHeader& header, std::span<const std::uint8_t> bytes, const Catalog& catalog, Tick now,
                       const Frame** taken) {
  const FrameStamp& theirs = header.stamp;
  if (theirs.closings < stamp_.peer_closings) return absl::OkStatus();
  if (theirs.closings > stamp_.peer_closings) {
    stamp_.peer_closings = theirs.closings;
    open_ = false;
    Forget();
  }
  if (theirs.peer_closings != stamp_.closings) return absl::OkStatus();  // it has not heard of ours yet
  if (theirs.offer) {
    TakeOffer(header, now);
    return absl::OkStatus();
  }
  // A neighbour that opened a little earlier.
  const bool early = !open_ && open_at_ != Tick() && theirs.number == 0;
  if (!open_ && !early) return absl::OkStatus();
  return PutFrame(header, bytes, catalog, now, taken);
}

void Link::TakeOffer(const FrameHeader& header, Tick now) {
  if (header.tick.value() > now.value() + kMaxTicksAhead ||
      header.stamp.open_at.value() > now.value() + kMaxTicksAhead) {
    return;
  }
  if (open_) {
    // It has missed the tick; or it waits, by way of others, for this side, which waits for it.
    if (here_ == 0 && (open_at_ < header.tick || ++offers_ > kMaxOffers)) Close();
  } else if (header.tick > now + kFarBehind) {
    adopt_ = std::max(adopt_, header.tick);
  } else if (now > header.tick + kFarBehind) {
    return;  // it adopts this side's first
  } else if (peer_ < self_) {
    if (open_at_ != Tick()) return;
    open_at_ = std::max(now, header.tick) + kOpeningTicks;
    offer_in_ = 0;
  } else if (header.stamp.open_at > now) {
    open_at_ = header.stamp.open_at;
  }
}

absl::Status Link::PutFrame(const FrameHeader& header, std::span<const std::uint8_t> bytes, const Catalog& catalog,
                            Tick now, const Frame** taken) {
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
  absl::StatusOr<Frame> frame = Decode(bytes, previous_);
  if (!frame.ok()) return frame.status();
  if (absl::Status status = CheckFrame(*frame, catalog); !status.ok()) return status;
  if (absl::Status status = CheckVouched(*frame); !status.ok()) return status;
  before_previous_ = std::exchange(previous_, frame->ghosts);
  before_.number = here_;
  before_.vouched = vouched_;
  before_newest_ = newest_;
  // What was vouched for in between and not taken yet would be forgotten with the frame that vouched for it.
  for (std::uint64_t i = std::max(here_, needed_); i < number; ++i) frames_.push_back(Vouched(i, before_previous_));
  here_ = number + 1;
  vouched_ = header.stamp.vouched;
  newest_ = header.tick;
  while (!news_.empty() && news_.front() < number) news_.pop_front();
  frames_.push_back(*std::move(frame));
  *taken = &frames_.back();
  return absl::OkStatus();
}

void Link::Reject() {
  assert(!frames_.empty());
  here_ = before_.number;
  vouched_ = before_.vouched;
  newest_ = before_newest_;
  previous_ = std::move(before_previous_);
  while (!frames_.empty() && frames_.back().stamp.number >= here_) frames_.pop_back();
}

std::uint64_t Link::ComesNext() const {
  const std::uint64_t vouched_end = here_ + vouched_;
  return vouched_ == 0 || news_.empty() ? vouched_end : std::min(vouched_end, std::max(news_.front() + 1, here_));
}

bool Link::Ready() const {
  if (!open_) return true;
  if (!frames_.empty() && frames_.front().stamp.number == needed_) return true;
  return here_ > 0 && needed_ >= here_ && needed_ < ComesNext();
}

Frame Link::Take(Tick now) {
  assert(Ready());
  Frame frame;
  if (!open_) {
    frame.tick = std::exchange(adopt_, Tick());
    return frame;
  }
  if (!frames_.empty() && frames_.front().stamp.number == needed_) {
    frame = std::move(frames_.front());
    frames_.pop_front();
    if (frame.tick != now) {
      strain_ += kStrain;
    } else if (strain_ > 0) {
      --strain_;
    }
    // Something new: what was vouched for after the own frame of this number comes after all.
    if (frame.stamp.vouched == 0) silent_end_ = std::min(silent_end_, needed_ + 1);
  } else {
    frame = Vouched(needed_, previous_);
  }
  ++needed_;
  return frame;
}

// By the newest frame, whose ghosts are `ghosts`.
Frame Link::Vouched(std::uint64_t number, const std::vector<GhostRecord>& ghosts) const {
  Frame frame;
  frame.sender = peer_;
  frame.stamp.number = number;
  frame.stamp.vouched = 1;  // no news
  frame.tick = newest_ + (number + 1 - here_);
  frame.ghosts = ghosts;
  return frame;
}

Link::Duty Link::DutyNow(Tick now) {
  if (open_ && strain_ > kMaxStrain) Close();
  if (open_) {
    if (Speaks()) return Duty::kFrame;
    ++stamp_.number;
    return Duty::kNothing;
  }
  if (open_at_ != Tick() && now == open_at_) {
    open_ = true;
    return Duty::kFirstFrame;
  }
  if (open_at_ != Tick() && now > open_at_) CloseAnew();  // it jumped over it
  if (offer_in_ > 0) {
    --offer_in_;
    return Duty::kNothing;
  }
  offer_in_ = kOfferTicks - 1;
  return Duty::kOffer;
}

FrameStamp Link::StampFrame(std::uint32_t vouched) {
  FrameStamp stamp = stamp_;
  stamp.vouched = vouched;
  if (vouched > 0) {
    silent_end_ = stamp_.number + 1 + vouched;
  } else {
    news_.push_back(stamp_.number);
  }
  ++stamp_.number;
  return stamp;
}

FrameStamp Link::StampOffer() const {
  FrameStamp stamp = stamp_;
  stamp.offer = true;
  stamp.open_at = peer_ < self_ ? open_at_ : Tick();
  return stamp;
}

void Link::Close() {
  if (!open_) return;
  open_ = false;
  CloseAnew();
}

void Link::Jumped() {
  if (!open_ && open_at_ != Tick()) CloseAnew();
}

// The other side must hear of it.
void Link::CloseAnew() {
  ++stamp_.closings;
  Forget();
}

void Link::Forget() {
  open_at_ = adopt_ = Tick();
  strain_ = 0;
  offers_ = 0;
  offer_in_ = 0;
  stamp_.number = here_ = needed_ = silent_end_ = 0;
  vouched_ = 0;
  frames_.clear();
  news_.clear();
  previous_.clear();
  before_previous_.clear();
}

}  // namespace tessera::region
