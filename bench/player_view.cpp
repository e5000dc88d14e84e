#include "bench/player_view.h"

#include <fmt/format.h>

#include <type_traits>
#include <utility>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/string_view.h"

namespace tessera::bench {
namespace {

absl::string_view AbslView(std::string_view text) { return {text.data(), text.size()}; }

std::vector<std::string> WordsOf(std::string_view line) {
  std::vector<std::string> words = absl::StrSplit(AbslView(line), ' ');
  return words;
}

// The words after the first, read one after the other.
class Words {
 public:
  explicit Words(std::string_view line) : words_(WordsOf(line)) {}

  const std::string& name() const { return words_.front(); }
  template <class Number>
  Number Next() {
    Number value{};
    if (next_ >= words_.size()) {
      good_ = false;
    } else if constexpr (std::is_floating_point_v<Number>) {
      good_ &= absl::SimpleAtod(words_[next_++], &value);
    } else {
      good_ &= absl::SimpleAtoi(words_[next_++], &value);
    }
    return value;
  }
  // All were read, and each was a number.
  bool Done() const { return good_ && next_ == words_.size(); }

 private:
  std::vector<std::string> words_;
  std::size_t next_ = 1;
  bool good_ = true;
};

}  // namespace

std::string InLine(BodyId body, Tick tick) { return fmt::format("in {} {}", body.value(), tick.value()); }

std::string FramesLine(const FrameCount& frames) { return fmt::format("frames {} {}", frames.due, frames.late); }

std::string SeesLine(BodyId body, const SeenPlace& place) {
  return fmt::format("sees {} {} {} {:.2f} {:.2f} {:.2f} {:.1f}", body.value(), place.tick.value(),
                     place.region.value(), place.x, place.y, place.z, place.speed);
}

std::string AllSeenLine() { return "seen"; }

std::string GapLine(const SeenGap& gap) {
  return fmt::format("gap {} {} {} {:.6f}", gap.watch, gap.watched, gap.over ? 1 : 0, gap.seconds);
}

// A reason may come from elsewhere, and is one line here.
std::string EndedLine(const std::string& reason) {
  std::string line = "ended " + reason;
  for (char& c : line) {
    if (c == '\n' || c == '\r') c = ' ';
  }
  return line;
}

absl::Status PlayerView::Take(std::string_view line) {
  constexpr std::string_view kEnded = "ended ";
  if (line.starts_with(kEnded)) {
    End(std::string(line.substr(kEnded.size())));
    return absl::OkStatus();
  }
  Words words(line);
  const auto wrong = [&] { return absl::InvalidArgumentError(absl::StrCat("no line of a player: ", AbslView(line))); };
  if (words.name() == "in") {
    const BodyId body(words.Next<std::uint64_t>());
    const Tick tick(words.Next<std::uint64_t>());
    if (!words.Done()) return wrong();
    body_ = body;
    tick_ = tick;
  } else if (words.name() == "frames") {
    FrameCount frames;
    frames.due = words.Next<std::uint64_t>();
    frames.late = words.Next<std::uint64_t>();
    if (!words.Done()) return wrong();
    frames_ = frames;
  } else if (words.name() == "sees") {
    const BodyId body(words.Next<std::uint64_t>());
    SeenPlace place;
    place.tick = Tick(words.Next<std::uint64_t>());
    place.region = RegionId(words.Next<std::uint32_t>());
    for (double* value : {&place.x, &place.y, &place.z, &place.speed}) *value = words.Next<double>();
    if (!words.Done()) return wrong();
    looking_[body] = place;
  } else if (words.name() == "seen") {
    if (!words.Done()) return wrong();
    sees_ = std::exchange(looking_, {});
  } else if (words.name() == "gap") {
    SeenGap gap;
    gap.watch = words.Next<std::uint64_t>();
    gap.watched = words.Next<std::uint64_t>();
    gap.over = words.Next<std::uint32_t>() != 0;
    gap.seconds = words.Next<double>();
    if (!words.Done()) return wrong();
    if (gap.watch == gap_.watch) gap_ = gap;
  } else {
    return wrong();
  }
  return absl::OkStatus();
}

void PlayerView::End(const std::string& reason) {
  if (!reason_) reason_ = reason;
}

}  // namespace tessera::bench
