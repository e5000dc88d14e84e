#include "client_sdk/playback.h"

#include <set>

namespace tessera::client {
namespace {

// The value is asked for after all events, so those before the last one would say the same.
void KeepLastOfEachWorldProperty(std::vector<ClientEvent>& events) {
  std::set<std::string> later;
  for (std::size_t i = events.size(); i-- > 0;) {
    if (events[i].kind != ClientEvent::Kind::kWorldPropertyChanged || later.insert(events[i].property).second) continue;
    events.erase(events.begin() + static_cast<std::ptrdiff_t>(i));
  }
}

}  // namespace

Playback::Playback(Playback from, std::chrono::microseconds at) : replay_(std::move(from.replay_)), catching_up_(true) {
  replay_.Seek(at);
}

void Playback::EndPoll(std::vector<ClientEvent>& events) {
  if (catching_up_) KeepLastOfEachWorldProperty(events);
  catching_up_ = false;
}

void Playback::AddNote(std::string text) {
  if (notes_.size() == kMaxNotes) notes_.erase(notes_.begin());
  notes_.push_back(std::move(text));
}

}  // namespace tessera::client
