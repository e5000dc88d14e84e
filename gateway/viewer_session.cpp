#include "gateway/viewer_session.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "gateway/viewer_format.h"

namespace tessera::gateway {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kDetailInterval{100}, kMetWindow{1000}, kValuesInterval{250}, kWorldInterval{100};
// Values in one message, some 20 kB of them: between them come the frames.
constexpr std::size_t kMaxValues = 1000;
// A world that stands still is shown again after so long, for its viewers to see that it is still shown.
constexpr milliseconds kStillInterval{500};
constexpr double kNoByteLimit = std::numeric_limits<double>::infinity();

}  // namespace

ViewerSession::ViewerSession()
    : rate_hz_(kFirstFrameRate_hz), limit_bytes_per_s_(kNoByteLimit), asked_bytes_per_s_(kNoByteLimit) {}

void ViewerSession::Show(const ViewFeed* view, const NewsFeed* news) {
  if (news != news_) status_number_ = events_ = recording_number_ = play_number_ = 0;
  view_ = view;
  news_ = news;
}

void ViewerSession::LimitBytes(double bytes_per_s) {
  limit_bytes_per_s_ = bytes_per_s;
  bytes_.Limit(std::min(limit_bytes_per_s_, asked_bytes_per_s_));
}

// --- What it sends ---------------------------------------------------------------------------------------------------

std::optional<ViewerMessage> ViewerSession::Receive(std::string_view text, TimePoint now) {
  if (final_) return std::nullopt;
  if (!budget_.Take(now)) {
    ReceiveBad("message: more than 120 a second", now);
    return std::nullopt;
  }
  absl::StatusOr<ViewerMessage> message = ParseViewerMessage(text);
  if (!message.ok()) {
    ReceiveBad(std::string(message.status().message()), now);
    return std::nullopt;
  }
  if (const auto* view = std::get_if<SetView>(&*message)) {
    rate_hz_ = view->rate_hz.value_or(rate_hz_);
    next_frame_ = now;  // not when the next one of an earlier rate was due
    shown_.radius_m = view->radius_m;
    if (view->center) shown_.center = *view->center;
    center_given_ = center_given_ || view->center.has_value();
    view_changed_ = true;
    asked_bytes_per_s_ = view->bytes_per_s.value_or(asked_bytes_per_s_);
    bytes_.Limit(std::min(limit_bytes_per_s_, asked_bytes_per_s_));
    return std::nullopt;
  }
  if (const auto* select = std::get_if<Select>(&*message)) {
    selected_ = select->body;
    last_detail_.clear();
    next_detail_ = now;
    return std::nullopt;
  }
  if (const auto* show = std::get_if<ShowProperty>(&*message)) {
    property_ = show->name;
    sent_values_.clear();
    next_values_ = now;
    return std::nullopt;
  }
  return *std::move(message);
}

void ViewerSession::ReceiveBad(const std::string& why, TimePoint now) {
  if (final_) return;
  ++bad_messages_;
  const bool last = budget_.Strike(now);
  Report({.code = "bad_message", .text = last ? why + "; it was the tenth in a minute" : why}, last);
}

void ViewerSession::AnswerWrongRight(std::uint64_t number, const absl::Status& status, const std::string& needs,
                                     TimePoint now) {
  if (final_) return;
  Answer(number, status, "", needs);
  ++bad_messages_;
  if (budget_.Strike(now)) {
    Report({.code = "bad_message", .text = std::string(status.message()) + "; it was the tenth in a minute"}, true);
  }
}

void ViewerSession::ReportTicket(const std::string& text, bool shown, TimePoint now) {
  if (final_) return;
  if (shown) ++bad_messages_;
  if (shown && budget_.Strike(now)) {
    return Report({.code = "bad_message", .text = text + "; it was the tenth in a minute"}, true);
  }
  Report({.code = "ticket", .text = text}, false);
}

void ViewerSession::Answer(std::uint64_t number, const absl::Status& status, const std::string& text,
                           const std::string& needs) {
  if (answers_.size() >= kMaxAnswers) {
    return Report({.code = "bad_message", .text = "order: more than 64 answers wait"}, true);
  }
  answers_.push_back(AnswerMessage(number, status, text, needs));
}

void ViewerSession::Report(Problem problem, bool final) {
  if (final_) return;
  final_ = final;
  problem_ = std::move(problem);
}

// --- What it is sent -------------------------------------------------------------------------------------------------

bool ViewerSession::Due(TimePoint now) const {
  return !over_ && (TextDue(now) || (!final_ && (SetupDue() || FrameDue(now))));
}

std::optional<OutgoingMessage> ViewerSession::Next(TimePoint now) {
  if (over_) return std::nullopt;
  if (problem_) {
    const Problem problem = *std::exchange(problem_, std::nullopt);
    over_ = final_;
    if (over_) close_code_ = problem.code;
    return SendText(ProblemMessage(problem));
  }
  if (const auto setup = NextSetup()) return setup;
  if (const auto text = NextText(now)) return text;
  return NextFrame(now);
}

bool ViewerSession::SetupDue() const {
  if (view_ == nullptr || view_->generation == 0) return false;
  return generation_ != view_->generation || scene_messages_ < view_->book->messages().size() ||
         map_number_ != view_->map_number;
}

std::optional<OutgoingMessage> ViewerSession::NextSetup() {
  if (!SetupDue()) return std::nullopt;
  if (generation_ != view_->generation) {
    generation_ = view_->generation;
    scene_messages_ = 0;
    map_number_ = world_number_ = 0;
    next_world_ = {};
    met_ = view_->met.end;
    encoder_.Begin();
    sent_values_.clear();
    next_frame_ = {};
    return OutgoingMessage{true, view_->welcome};
  }
  const std::vector<Bytes>& scene = view_->book->messages();
  if (scene_messages_ < scene.size()) return OutgoingMessage{true, scene[scene_messages_++]};
  map_number_ = view_->map_number;
  return OutgoingMessage{true, view_->map};
}

bool ViewerSession::DetailDue(TimePoint now) const {
  return selected_ != BodyId() && view_ != nullptr && generation_ != 0 && view_->detail && now >= next_detail_;
}

bool ViewerSession::ValuesDue(TimePoint now) const {
  return !property_.empty() && view_ != nullptr && generation_ != 0 && generation_ == view_->generation &&
         view_->values && now >= next_values_;
}

bool ViewerSession::WorldDue(TimePoint now) const {
  return view_ != nullptr && generation_ != 0 && generation_ == view_->generation &&
         world_number_ != view_->world_number && now >= next_world_;
}

// Those that differ from what was sent; empty: none do, or the budget is spent.
std::string ViewerSession::NewValues(TimePoint now) {
  next_values_ = now + kValuesInterval;
  if (bytes_.Left(now) == 0) return "";
  const PropertyValues& values = view_->values(property_, now);
  std::erase_if(sent_values_, [&](const auto& sent) { return !values.contains(sent.first); });
  PropertyValues changed;
  for (const auto& [body, value] : values) {
    const auto sent = sent_values_.find(body);
    if (sent != sent_values_.end() && sent->second == value) continue;
    if (changed.size() == kMaxValues) {
      next_values_ = now;
      break;
    }
    changed[body] = sent_values_[body] = value;
  }
  return changed.empty() ? "" : ValuesMessage(property_, changed);
}

bool ViewerSession::TextDue(TimePoint now) const {
  if (problem_ || !answers_.empty()) return true;
  if (final_) return false;
  if (news_ != nullptr && (news_->status_number != status_number_ || news_->events.end != events_ ||
                           news_->recording_number != recording_number_ || news_->play_number != play_number_)) {
    return true;
  }
  return (view_ != nullptr && view_->generation == generation_ && view_->met.end != met_) || DetailDue(now) ||
         ValuesDue(now) || WorldDue(now);
}

std::optional<OutgoingMessage> ViewerSession::NextText(TimePoint now) {
  if (!answers_.empty()) {
    std::string answer = std::move(answers_.front());
    answers_.pop_front();
    return SendText(std::move(answer));
  }
  if (news_ != nullptr && news_->status_number != status_number_) {
    status_number_ = news_->status_number;
    return SendText(news_->status);
  }
  if (news_ != nullptr && news_->events.end != events_) {
    const std::vector<v1::InstanceEvent> events = news_->events.After(events_);
    events_ = news_->events.end;
    return SendText(EventsMessage(events));
  }
  if (news_ != nullptr && news_->recording_number != recording_number_) {
    recording_number_ = news_->recording_number;
    return SendText(news_->recording);
  }
  if (news_ != nullptr && news_->play_number != play_number_) {
    play_number_ = news_->play_number;
    return SendText(news_->play);
  }
  if (view_ != nullptr && view_->generation == generation_ && view_->met.end != met_) {
    if (now - met_window_ >= kMetWindow) {
      met_window_ = now;
      met_in_window_ = 0;
    }
    const std::vector<std::string> met = view_->met.After(met_);
    if (met_in_window_ < kMaxMet_per_s) {
      // The oldest that is kept first; what is not kept any more was too much.
      met_ = view_->met.end - met.size() + 1;
      ++met_in_window_;
      return SendText(met.front());
    }
    met_ = view_->met.end;
  }
  if (WorldDue(now)) {
    next_world_ = now + kWorldInterval;
    if (bytes_.Left(now) > 0) {
      world_number_ = view_->world_number;
      bytes_.Spend(view_->world.size());
      return SendText(view_->world);
    }
  }
  if (DetailDue(now)) {
    next_detail_ = now + kDetailInterval;
    std::string detail = view_->detail(selected_);
    if (!detail.empty() && detail != last_detail_) return SendText(last_detail_ = std::move(detail));
  }
  if (ValuesDue(now)) {
    if (std::string values = NewValues(now); !values.empty()) {
      bytes_.Spend(values.size());
      return SendText(std::move(values));
    }
  }
  return std::nullopt;
}

bool ViewerSession::FrameDue(TimePoint now) const {
  if (view_ == nullptr || generation_ == 0 || generation_ != view_->generation || view_->picture == nullptr)
    return false;
  if (view_changed_) return true;
  return now >= next_frame_ - kPunctual && (!view_->picture->paused || now - last_frame_ >= kStillInterval);
}

std::optional<OutgoingMessage> ViewerSession::NextFrame(TimePoint now) {
  if (final_ || !FrameDue(now)) return std::nullopt;
  if (follow_ != BodyId() && !center_given_) {
    const auto& bodies = view_->picture->bodies;
    const auto own = std::lower_bound(bodies.begin(), bodies.end(), follow_,
                                      [](const PictureBody& body, BodyId id) { return body.id < id; });
    if (own != bodies.end() && own->id == follow_) {
      shown_.center = {static_cast<double>(own->position[0]) / kPositionSteps_per_m,
                       static_cast<double>(own->position[1]) / kPositionSteps_per_m,
                       static_cast<double>(own->position[2]) / kPositionSteps_per_m};
    }
  }
  frame_.Wrote(frame_.bytes().data());
  shown_.near_first = center_given_ || follow_ != BodyId();
  shown_.foremost = selected_ != BodyId() ? selected_ : follow_;
  shown_.max_bytes = bytes_.Left(now);
  content_ = encoder_.Frame(*view_->picture, shown_, frame_);
  bytes_.Spend(frame_.size());
  view_changed_ = false;
  last_frame_ = now;
  const std::chrono::nanoseconds interval(1'000'000'000 / rate_hz_);
  // Keeps the rhythm over the loop's own steps, and none of what was missed.
  next_frame_ = std::max(next_frame_ + interval, now + interval / 2);
  ++frames_;
  return OutgoingMessage{true, frame_.bytes()};
}

OutgoingMessage ViewerSession::SendText(std::string text) {
  text_ = std::move(text);
  return {false, {reinterpret_cast<const std::uint8_t*>(text_.data()), text_.size()}};
}

}  // namespace tessera::gateway
