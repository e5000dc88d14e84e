#include "bench/player_seat.h"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstddef>
#include <ctime>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <set>
#include <sstream>
#include <utility>

#include "bench/failover_watch.h"
#include "bench/player_view.h"
#include "local_cluster/bot.h"
#include "local_cluster/poll_schedule.h"

namespace tessera::bench {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::nanoseconds kPlayerFrame{8'333'333};
constexpr std::chrono::milliseconds kCountsApart{250};
constexpr std::chrono::seconds kLooksApart{2};
constexpr std::size_t kPlayersInSeat = 1;

class SeatedPlayer {
 public:
  explicit SeatedPlayer(std::unique_ptr<local::Bot> bot) : bot_(std::move(bot)) {}

  int Play();

 private:
  bool TakeOrders();
  void Obey(const std::string& line);
  bool Frame(Clock::time_point now);
  void Say(const std::string& line) { said_ += line + "\n"; }
  void SayWhere();
  void SayGap(Clock::time_point now);
  bool Flush();

  std::unique_ptr<local::Bot> bot_;
  local::PollSchedule schedule_{kPlayerFrame, kPlayersInSeat};
  std::string unread_, said_;
  bool is_in_ = false;
  std::uint64_t watch_number_ = 0;
  std::optional<GapWatch> watch_;
  std::size_t watched_ = 0;  // as it was said last
  Clock::time_point next_counts_{}, next_look_{};
};

// Waits for the next frame or an order. False at the end of the input.
bool SeatedPlayer::TakeOrders() {
  const auto left = std::max<std::chrono::nanoseconds>(*schedule_.next() - Clock::now(), std::chrono::nanoseconds(0));
  const timespec wait{static_cast<time_t>(left / std::chrono::seconds(1)),
                      static_cast<long>((left % std::chrono::seconds(1)).count())};
  pollfd input{STDIN_FILENO, POLLIN, 0};
  if (ppoll(&input, 1, &wait, nullptr) <= 0) return true;
  char bytes[4096];
  const ssize_t count = read(STDIN_FILENO, bytes, sizeof(bytes));
  if (count <= 0) return false;
  unread_.append(bytes, static_cast<std::size_t>(count));
  for (std::size_t end; (end = unread_.find('\n')) != std::string::npos; unread_.erase(0, end + 1)) {
    Obey(unread_.substr(0, end));
  }
  return true;
}

void SeatedPlayer::Obey(const std::string& line) {
  std::istringstream words(line);
  std::string name;
  std::set<RegionId> regions;
  words >> name >> watch_number_;
  for (std::uint32_t region = 0; words >> region;) regions.insert(RegionId(region));
  if (name != "watch" || regions.empty()) return;
  watch_.emplace(std::move(regions), std::vector<local::Bot*>{bot_.get()});
  watched_ = 0;
}

void SeatedPlayer::SayWhere() {
  for (const auto& [id, body] : bot_->client().World()) {
    const Vec3d at = body.state.position;
    Say(SeesLine(id, {body.tick, body.region, at.x, at.y, at.z, Length(body.state.linear_velocity)}));
  }
  Say(AllSeenLine());
}

void SeatedPlayer::SayGap(Clock::time_point now) {
  if (!watch_ || watch_->found_most()) return;
  watch_->Look(now);
  const bool over = watch_->found_most();
  if (watch_->watched() == watched_ && !over) return;
  watched_ = watch_->watched();
  Say(GapLine({watch_number_, watched_, over, over ? watch_->gap_s() : 0}));
}

bool SeatedPlayer::Frame(Clock::time_point now) {
  if (!bot_->Frame(now)) {
    Say(EndedLine(bot_->client().reason().ToString()));
    return false;
  }
  client::Client& client = bot_->client();
  if (!is_in_ && client.own_body() != BodyId() && client.World().contains(client.own_body())) {
    is_in_ = true;
    Say(InLine(client.own_body(), client.tick()));
  }
  SayGap(now);
  if (now >= next_counts_) {
    next_counts_ = now + kCountsApart;
    Say(FramesLine({schedule_.taken() + schedule_.late(), schedule_.late()}));
  }
  if (now >= next_look_) {
    next_look_ = now + kLooksApart;
    SayWhere();
  }
  return true;
}

// False: nobody listens any more.
bool SeatedPlayer::Flush() {
  for (std::size_t begin = 0; begin < said_.size();) {
    const ssize_t count = write(STDOUT_FILENO, said_.data() + begin, said_.size() - begin);
    if (count < 0) return false;
    begin += static_cast<std::size_t>(count);
  }
  said_.clear();
  return true;
}

int SeatedPlayer::Play() {
  schedule_.Add(0, Clock::now());
  while (TakeOrders()) {
    if (!schedule_.Take(Clock::now())) continue;  // an order came first
    const bool plays = Frame(Clock::now());
    if (!Flush()) return 0;
    if (!plays) return 1;
  }
  return 0;
}

}  // namespace

std::vector<std::vector<std::string>> SeatCommands(const std::string& control, const std::string& instance,
                                                   std::uint32_t players) {
  const std::string program = std::filesystem::read_symlink("/proc/self/exe").string();
  std::vector<std::vector<std::string>> commands;
  commands.reserve(players);
  for (std::uint32_t i = 1; i <= players; ++i) {
    commands.push_back({program, "player", control, instance, std::to_string(i)});
  }
  return commands;
}

int PlayInSeat(const PlayerSeat& seat) {
  std::signal(SIGPIPE, SIG_IGN);
  auto bot = local::Bot::Join(seat.control, seat.instance, fmt::format("bot-{}", seat.seed), seat.seed);
  if (!bot.ok()) {
    std::cout << EndedLine(bot.status().ToString()) << std::endl;
    return 1;
  }
  return SeatedPlayer(*std::move(bot)).Play();
}

}  // namespace tessera::bench
