#include "cli/playback.h"

#include <algorithm>
#include <cmath>

#include "fmt/format.h"

namespace tessera::cli {
namespace {

std::string Minutes(std::chrono::nanoseconds time) {
  const auto hundredths = time.count() / 10'000'000;
  return fmt::format("{}:{:02}.{:02}", hundredths / 6000, hundredths / 100 % 60, hundredths % 100);
}

}  // namespace

Playback::Playback(std::chrono::microseconds length, std::chrono::microseconds from, double speed, bool stays)
    : length_(length), place_(from), speed_(speed), stays_(stays) {}

void Playback::Advance(client::TimePoint now) {
  const std::chrono::nanoseconds since = before_ ? now - *before_ : std::chrono::nanoseconds(0);
  before_ = now;
  if (paused_) return;
  std::chrono::nanoseconds step(std::llround(static_cast<double>(since.count()) * speed_));
  if (stays_ && place_ + step >= length_) {
    step = std::max(length_ - place_ - std::chrono::microseconds(1), std::chrono::nanoseconds(0));
    paused_ = true;
  }
  client_time_ += step;
  place_ = std::min(place_ + step, length_);
}

std::optional<std::chrono::microseconds> Playback::Press(Key key) {
  switch (key) {
    case Key::kSpace:
      paused_ = !paused_;
      return std::nullopt;
    case Key::kLeft:
      return To(place_ - kJump);
    case Key::kRight:
      return To(place_ + kJump);
    case Key::kHome:
      return To(std::chrono::nanoseconds(0));
    case Key::kEnd:
      return To(length_);
    case Key::kComma:
    case Key::kPeriod:
      paused_ = true;
      return To(key == Key::kComma ? place_ - kStep : place_ + kStep);
    case Key::kUp:
      speed_ = std::min(speed_ * 2, kFastest);
      return std::nullopt;
    case Key::kDown:
      speed_ = std::max(speed_ / 2, kSlowest);
      return std::nullopt;
    case Key::kQ:
      ended_ = true;
      return std::nullopt;
  }
  return std::nullopt;
}

// Where `stays_`, the last place is just before the end, for at the end the client ends.
std::optional<std::chrono::microseconds> Playback::To(std::chrono::nanoseconds place) {
  const std::chrono::nanoseconds last = stays_ ? length_ - std::chrono::microseconds(1) : length_;
  place_ = std::max(std::min(place, last), std::chrono::nanoseconds(0));
  return this->place();
}

std::string Playback::Line() const {
  std::string line = fmt::format("{} of {}", Minutes(place_), Minutes(length_));
  if (speed_ != 1) line += fmt::format(", {:g} times as fast", speed_);
  if (paused_) line += ", paused";
  return line;
}

}  // namespace tessera::cli
