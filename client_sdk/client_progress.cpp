#include "client_sdk/client_progress.h"

namespace tessera::client {

void ClientProgress::Stand(bool started) {
  started_ = started;
  state_ = started ? ClientState::kPlaying : ClientState::kWaiting;
}

void ClientProgress::EndSilence() {
  silent_since_.reset();
  asked_for_grant_ = false;
}

bool ClientProgress::End(absl::Status why, bool needs_new_grant) {
  if (ended()) return false;
  state_ = ClientState::kEnded;
  reason_ = std::move(why);
  needs_new_grant_ = needs_new_grant;
  return true;
}

ClientProgress::Due ClientProgress::Look(TimePoint now, const Seen& seen) {
  if (!joined_by_.has_value()) joined_by_ = now + deadline_;
  if (state_ == ClientState::kJoining && seen.scene && seen.all_welcomed) state_ = ClientState::kWaiting;
  if (state_ == ClientState::kWaiting && started_) state_ = ClientState::kPlaying;
  const bool joining = state_ == ClientState::kJoining;
  if (joining && now >= *joined_by_) return {.late = true, .search = false, .ask_grant = false, .lost = false};
  if (seen.any_heard) {
    EndSilence();
    return {};
  }
  if (!silent_since_.has_value()) silent_since_ = now;
  const auto silent = now - *silent_since_;
  const bool ask = silent >= kAskForGrantAfter && !joining && !asked_for_grant_;
  asked_for_grant_ = asked_for_grant_ || ask;
  return {.late = false, .search = silent >= kSearchAfter, .ask_grant = ask, .lost = silent >= kMaxSilence && !joining};
}

}  // namespace tessera::client
