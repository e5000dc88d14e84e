#include "client_sdk/command_queue.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "core/replication/command.h"

namespace tessera::client {

absl::Status CommandQueue::Push(std::string_view bytes, std::uint64_t shown_at, std::uint32_t with_input) {
  if (bytes.size() > replication::kMaxCommandBytes) {
    return absl::InvalidArgumentError(
        absl::StrCat("bytes: ", bytes.size(), " are more than ", replication::kMaxCommandBytes));
  }
  if (pending_.size() >= kMaxPending) {
    return absl::ResourceExhaustedError(absl::StrCat(kMaxPending, " commands wait to be taken already"));
  }
  pending_.push_back({std::string(bytes), shown_at, with_input});
  if (with_input != 0) hurry_ = kHurried + 1;
  return absl::OkStatus();
}

void CommandQueue::Taken(std::uint32_t last_command) {
  if (!begun_) {
    begun_ = true;
    base_ = last_command + static_cast<std::uint32_t>(kMaxPending) + 1;
    return;
  }
  while (!pending_.empty() && base_ <= last_command) {
    pending_.pop_front();
    ++base_;
    sent_ -= std::min<std::size_t>(sent_, 1);
  }
}

void CommandQueue::Drop(std::uint32_t number) {
  if (begun_ && number == base_ && !pending_.empty()) Taken(number);
}

bool CommandQueue::Due(TimePoint now) const {
  if (begun_ && sent_ < pending_.size()) return true;
  const bool waits = begun_ && !pending_.empty();
  const std::chrono::milliseconds repeat = waits && hurry_ > 0 ? kHurry : kRepeat;
  return (waits || acknowledgements_due_ > 0) && (!sent_at_ || now - *sent_at_ >= repeat);
}

std::vector<std::uint8_t> CommandQueue::Write(TimePoint now, std::uint32_t last_event) {
  replication::CommandMessage message{last_event, base_, {}};
  if (begun_) {
    for (const Pending& command : pending_) {
      message.commands.emplace_back(command.bytes, command.shown_at, command.with_input);
    }
  }
  const std::size_t fit = replication::CommandsThatFit(message.commands);
  message.commands.erase(message.commands.begin() + static_cast<std::ptrdiff_t>(fit), message.commands.end());
  sent_ = pending_.size();  // those that did not fit go when the first are taken, or with the next repetition
  sent_at_ = now;
  hurry_ = std::max(0, hurry_ - 1);
  acknowledgements_due_ = std::max(0, acknowledgements_due_ - 1);
  return replication::EncodeCommands(message);
}

}  // namespace tessera::client
