// ViewerSession: one viewer's side of the protocol, without its socket: what it is sent next, and what becomes of what
// it sends.
//
// The things that viewers share (a world's picture, figures, events) stand in feeds, kept up to date by the gateway. A
// session keeps only what it was sent, so nothing queues for a viewer that reads slowly: `Next` makes a message when
// the socket can take one, out of what is newest then. What cannot be left out (answers, the first messages) is
// bounded.
//
// Frames, values and the world's properties keep to a budget of bytes a second, the lower of the gateway's limit and
// the viewer's own: a frame that has no room for all leaves out what the viewer would miss least.
//
//   session.Show(view_feed, news_feed);
//   on writable:  if (auto message = session.Next(now)) Write(*message);
//   on message:   if (auto asked = session.Receive(text, now)) Do(*asked);
//   every frame:  if (session.Due(now)) AskForWritable();
//
// Feeds outlive the session or are replaced by Show. Thread rule: one thread.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "gateway/byte_budget.h"
#include "gateway/gateway_message.h"
#include "gateway/scene_book.h"
#include "gateway/viewer_encoder.h"
#include "gateway/viewer_message.h"

namespace tessera::gateway {

// Lines that come one by one, of which a session sends what is new to it. Only the newest are kept.
template <class Line>
struct Lines {
  std::deque<Line> kept;
  std::uint64_t end = 0;  // number of the last one, from 1

  void Add(Line line, std::size_t most) {
    kept.push_back(std::move(line));
    if (kept.size() > most) kept.pop_front();
    ++end;
  }
  // Those after number `sent`, as far as they are kept.
  std::vector<Line> After(std::uint64_t sent) const {
    const auto missing = static_cast<std::size_t>(std::min<std::uint64_t>(end - std::min(sent, end), kept.size()));
    return {kept.end() - static_cast<std::ptrdiff_t>(missing), kept.end()};
  }
};

// The view of those who look through the eyes of one client.
struct ViewFeed {
  std::uint64_t generation = 0;  // counts clients; another one begins with a welcome
  std::shared_ptr<const SceneBook> book;
  Bytes welcome, map;
  std::uint64_t map_number = 0;
  const Picture* picture = nullptr;  // the newest
  std::string world;                 // the newest of the world's properties; empty: it has none
  std::uint64_t world_number = 0;
  Lines<std::string> met;
  std::function<std::string(BodyId)> detail;
  // Values of the property, not older than some tenths of a second; until the next call.
  std::function<const PropertyValues&(const std::string&, std::chrono::steady_clock::time_point)> values;
};
// The news of the world as a whole.
struct NewsFeed {
  std::string status;
  std::uint64_t status_number = 0;
  Lines<v1::InstanceEvent> events;
  // The newest of what is said of a recording of the world, and of where a recording is that is played; empty: nothing.
  std::string recording, play;
  std::uint64_t recording_number = 0, play_number = 0;
};

struct OutgoingMessage {
  bool binary = false;
  std::span<const std::uint8_t> bytes;  // until the next call
};

class ViewerSession {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  ViewerSession();
  // Other feeds from now on; null: none yet, or no longer.
  void Show(const ViewFeed* view, const NewsFeed* news);

  // The next message; nothing while there is none. After a final problem that is the last one.
  std::optional<OutgoingMessage> Next(TimePoint now);
  // Whether it is time for a frame, for which there has to be a picture.
  bool WantsFrame(TimePoint now) const { return !final_ && (view_changed_ || now >= next_frame_ - kPunctual); }
  // Whether there would be one.
  bool Due(TimePoint now) const;

  // A text that came. The message for the gateway to carry out; nothing for what the session does itself, and for what
  // is wrong, which the viewer is sent.
  std::optional<ViewerMessage> Receive(std::string_view text, TimePoint now);
  // Something came that is no message: too long, or not a text.
  void ReceiveBad(const std::string& why, TimePoint now);

  void Answer(std::uint64_t number, const absl::Status& status, const std::string& text, const std::string& needs = "");
  // A right that was shown is worth nothing: as bad as a bad message, so that nobody guesses on and on.
  void AnswerWrongRight(std::uint64_t number, const absl::Status& status, const std::string& needs, TimePoint now);
  // A ticket is needed, or the one that was shown counts for nothing, which is as bad as a bad message. The viewer
  // watches on.
  void ReportTicket(const std::string& text, bool shown, TimePoint now);
  // Sends the problem; one that is final closes the viewer once it is sent.
  void Report(Problem problem, bool final);
  // Nothing more is to be sent: close with the code.
  bool over() const { return over_; }
  const std::string& close_code() const { return close_code_; }

  // The most that it is sent; without this call there is no limit.
  void LimitBytes(double bytes_per_s);
  // The body that the view of a player follows while it names no centre.
  void FollowBody(BodyId body) { follow_ = body; }
  BodyId selected() const { return selected_; }
  std::uint32_t rate_hz() const { return rate_hz_; }
  std::uint64_t frames() const { return frames_; }
  const FrameContent& last_frame() const { return content_; }
  std::uint64_t bad_messages() const { return bad_messages_; }

 private:
  // Answers that wait for a viewer that does not read; then it is closed.
  static constexpr std::size_t kMaxAnswers = 64;
  // A frame may come so much early, for the loop ticks so unpunctually: a whole tick later would be a third less of
  // them.
  static constexpr std::chrono::milliseconds kPunctual{3};

  std::optional<OutgoingMessage> NextSetup();
  std::optional<OutgoingMessage> NextText(TimePoint now);
  std::optional<OutgoingMessage> NextFrame(TimePoint now);
  OutgoingMessage SendText(std::string text);
  bool SetupDue() const;
  bool TextDue(TimePoint now) const;
  bool FrameDue(TimePoint now) const;
  bool DetailDue(TimePoint now) const;
  bool ValuesDue(TimePoint now) const;
  bool WorldDue(TimePoint now) const;
  std::string NewValues(TimePoint now);

  const ViewFeed* view_ = nullptr;
  const NewsFeed* news_ = nullptr;

  // The last of the feeds that was sent.
  std::uint64_t generation_ = 0;  // 0: no welcome yet
  std::size_t scene_messages_ = 0;
  std::uint64_t map_number_ = 0, status_number_ = 0, events_ = 0, met_ = 0, recording_number_ = 0, play_number_ = 0,
                world_number_ = 0;
  bool view_changed_ = false;  // since the last frame
  ViewerEncoder encoder_;

  // The viewer's wishes.
  std::uint32_t rate_hz_;
  ViewerView shown_;
  BodyId follow_{}, selected_{};
  bool center_given_ = false;
  double limit_bytes_per_s_, asked_bytes_per_s_;  // the gateway's and its own; infinite: none

  MessageBudget budget_;
  ByteBudget bytes_;
  std::deque<std::string> answers_;
  std::optional<Problem> problem_;
  bool final_ = false, over_ = false;
  std::string close_code_;

  TimePoint next_frame_{}, next_detail_{}, last_frame_{}, met_window_{};
  std::size_t met_in_window_ = 0;
  std::string last_detail_;
  std::string property_;        // the one whose values are sent; empty: none
  PropertyValues sent_values_;  // only of bodies that are there still
  TimePoint next_values_{}, next_world_{};
  FrameContent content_;
  std::uint64_t frames_ = 0, bad_messages_ = 0;
  ByteWriter frame_;
  std::string text_;
};

}  // namespace tessera::gateway
