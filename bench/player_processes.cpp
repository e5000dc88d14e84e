#include "bench/player_processes.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <utility>

#include "bench/statistics.h"

extern char** environ;

namespace tessera::bench {
namespace {

// Holds what a player says while the bench waits for a program to start: a look around is about 100 kB.
constexpr int kPipeBytes = 1 << 20;
constexpr std::chrono::seconds kForTheRest{1}, kLeavePatience{5};

struct Pipe {
  int read_end = -1, write_end = -1;
};

absl::StatusOr<Pipe> MakePipe() {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) return absl::InternalError(fmt::format("pipe: {}", std::strerror(errno)));
  return Pipe{ends[0], ends[1]};
}

void CloseEnd(int& descriptor) {
  if (descriptor >= 0) close(std::exchange(descriptor, -1));
}

// Its standard input and output are these ends; what it has to say to people goes where ours does.
absl::StatusOr<pid_t> SpawnPlayer(const std::vector<std::string>& command, int input, int output) {
  std::vector<char*> argv;
  argv.reserve(command.size() + 1);
  for (const std::string& word : command) argv.push_back(const_cast<char*>(word.c_str()));
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, input, STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, output, STDOUT_FILENO);
  pid_t pid = 0;
  const int error = posix_spawn(&pid, argv[0], &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0) return absl::InternalError(fmt::format("{}: {}", command.front(), std::strerror(error)));
  return pid;
}

}  // namespace

struct PlayerProcesses::Player {
  Player() = default;
  Player(const Player&) = delete;
  Player& operator=(const Player&) = delete;
  ~Player() {
    CloseEnd(orders);
    CloseEnd(says);
    if (pid > 0) waitpid(pid, nullptr, 0);
  }

  pid_t pid = 0;
  int orders = -1, says = -1;
  std::string unread;  // the beginning of a line
  PlayerView view;
};

PlayerProcesses::PlayerProcesses() = default;

absl::StatusOr<std::unique_ptr<PlayerProcesses>> PlayerProcesses::Start(
    const std::vector<std::vector<std::string>>& commands) {
  std::unique_ptr<PlayerProcesses> result(new PlayerProcesses());
  std::signal(SIGPIPE, SIG_IGN);  // an order to one that has ended is no reason to end
  for (const std::vector<std::string>& command : commands) {
    auto player = std::make_unique<Player>();
    absl::StatusOr<Pipe> orders = MakePipe();
    if (!orders.ok()) return orders.status();
    player->orders = orders->write_end;
    absl::StatusOr<Pipe> says = MakePipe();
    if (!says.ok()) {
      CloseEnd(orders->read_end);
      return says.status();
    }
    player->says = says->read_end;
    absl::StatusOr<pid_t> pid = SpawnPlayer(command, orders->read_end, says->write_end);
    CloseEnd(orders->read_end);
    CloseEnd(says->write_end);
    if (!pid.ok()) return pid.status();
    player->pid = *pid;
    fcntl(player->says, F_SETPIPE_SZ, kPipeBytes);  // more than this user may have is as well without
    fcntl(player->says, F_SETFL, O_NONBLOCK);
    result->players_.push_back(std::move(player));
  }
  return result;
}

PlayerProcesses::~PlayerProcesses() {
  for (const auto& player : players_) CloseEnd(player->orders);  // all leave at the same time
  const auto deadline = Clock::now() + kLeavePatience;
  for (const auto& player : players_) {
    // Its last words are read, for it may wait for that; its end closes the pipe.
    while (player->says >= 0) {
      const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()).count();
      pollfd end{player->says, POLLIN, 0};
      if (left <= 0 || poll(&end, 1, static_cast<int>(left)) <= 0) {
        kill(player->pid, SIGKILL);
        break;
      }
      Read(*player);
    }
  }
}

void PlayerProcesses::Read(Player& player) {
  char bytes[65536];
  while (player.says >= 0) {
    const ssize_t count = read(player.says, bytes, sizeof(bytes));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0 && errno == EAGAIN) return;
    if (count <= 0) {
      player.view.End("its process has ended");
      return CloseEnd(player.says);
    }
    player.unread.append(bytes, static_cast<std::size_t>(count));
    std::size_t begin = 0;
    for (std::size_t end; (end = player.unread.find('\n', begin)) != std::string::npos; begin = end + 1) {
      const absl::Status status = player.view.Take(std::string_view(player.unread).substr(begin, end - begin));
      if (!status.ok() && wrong_.ok()) wrong_ = absl::InternalError(status.message());
    }
    player.unread.erase(0, begin);
  }
}

absl::Status PlayerProcesses::TakeIn(Clock::time_point now) {
  for (const auto& player : players_) Read(*player);
  if (!wrong_.ok()) return wrong_;
  if (ended() > 0) return absl::InternalError(WhyEnded());
  std::size_t watch = 0, over = 0;
  for (const auto& player : players_) {
    if (player->view.gap().watched > 0) ++watch;
    if (player->view.gap().over) ++over;
  }
  if (2 * over > watch && !most_saw_at_) most_saw_at_ = now;
  saw_others_ |= most_saw_at_ && (over == watch || now - *most_saw_at_ >= kForTheRest);
  return absl::OkStatus();
}

std::vector<const PlayerView*> PlayerProcesses::views() const {
  std::vector<const PlayerView*> all;
  all.reserve(players_.size());
  for (const auto& player : players_) all.push_back(&player->view);
  return all;
}

bool PlayerProcesses::AllIn() const {
  return std::ranges::all_of(players_, [](const auto& player) { return player->view.body().has_value(); });
}

FrameCount PlayerProcesses::frames() const {
  FrameCount sum;
  for (const auto& player : players_) {
    sum.due += player->view.frames().due;
    sum.late += player->view.frames().late;
  }
  return sum;
}

std::size_t PlayerProcesses::ended() const {
  return static_cast<std::size_t>(
      std::ranges::count_if(players_, [](const auto& player) { return player->view.ended(); }));
}

std::string PlayerProcesses::WhyEnded() const {
  std::string why;
  for (std::size_t i = 0; i < players_.size(); ++i) {
    if (!players_[i]->view.ended()) continue;
    why += fmt::format("{}player {}: {}", why.empty() ? "" : ", ", i + 1, players_[i]->view.reason());
  }
  return why;
}

void PlayerProcesses::Watch(const std::set<RegionId>& regions) {
  std::string order = fmt::format("watch {}", ++watch_);
  for (const RegionId region : regions) order += fmt::format(" {}", region.value());
  order += '\n';
  for (const auto& player : players_) {
    player->view.WatchAnew(watch_);
    // A whole order fits the pipe; one that has ended is noticed where its words are read.
    if (player->orders >= 0) (void)!write(player->orders, order.data(), order.size());
  }
  most_saw_at_.reset();
  saw_others_ = false;
}

std::vector<double> PlayerProcesses::Gaps() const {
  std::vector<double> gaps;
  for (const auto& player : players_) {
    if (player->view.gap().over) gaps.push_back(player->view.gap().seconds);
  }
  return gaps;
}

double PlayerProcesses::gap_s() const {
  const std::vector<double> gaps = Gaps();
  return gaps.empty() ? 0 : Median(gaps);
}

double PlayerProcesses::worst_gap_s() const {
  const std::vector<double> gaps = Gaps();
  return gaps.empty() ? 0 : std::ranges::max(gaps);
}

}  // namespace tessera::bench
