#include "app.h"

#include <imgui.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace desktop {
namespace {

constexpr double kListEvery_s = 1.5;
constexpr float kLongestTurn_s = 0.1F;  // a frame that took long does not whirl the camera round
constexpr std::chrono::milliseconds kListDeadline{3000}, kJoinDeadline{10'000}, kLeaveDeadline{500};

template <class T>
bool IsReady(const std::future<T>& future) {
  return future.valid() && future.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

const char* NameOf(Screen screen) {
  static constexpr std::array<const char*, 5> kNames = {"menu", "joining", "waiting", "world", "ended"};
  return kNames[static_cast<std::size_t>(screen)];
}

}  // namespace

App::App(const Options& options, Renderer& renderer) : renderer_(renderer), visuals_(options.visuals, options.page) {
  menu_.address = options.control;
  menu_.player_name = options.name;
  menu_.ticket = options.ticket;
  if (!options.instance.empty()) Join(options.instance);
}

App::~App() {
  if (client_) client_->Leave(kLeaveDeadline);
}

const tessera::InstanceInfo* App::Listed(const std::string& id) const {
  const auto found = std::find_if(all_.begin(), all_.end(), [&](const auto& world) { return world.id == id; });
  return found == all_.end() ? nullptr : &*found;
}

void App::AskForWorlds(double now_s) {
  if (listing_.valid() || now_s < list_due_s_) return;
  list_due_s_ = now_s + kListEvery_s;
  listed_from_ = menu_.address;
  listing_ = std::async(std::launch::async, [address = menu_.address] {
    Listing listing;
    listing.first = tessera::ListInstances(address, listing.second, kListDeadline);
    return listing;
  });
}

void App::TakeWorlds() {
  if (!IsReady(listing_)) return;
  auto [error, worlds] = listing_.get();
  if (listed_from_ != menu_.address) {  // the answer of another address
    list_due_s_ = 0;
    return;
  }
  const std::string chosen = menu_.chosen < menu_.worlds.size() ? menu_.worlds[menu_.chosen].id : "";
  all_ = std::move(worlds);
  menu_.worlds.clear();
  std::copy_if(all_.begin(), all_.end(), std::back_inserter(menu_.worlds), CanBeJoined);
  for (std::size_t i = 0; i < menu_.worlds.size(); ++i) menu_.chosen = menu_.worlds[i].id == chosen ? i : menu_.chosen;
  menu_.chosen = std::min(menu_.chosen, menu_.worlds.empty() ? 0 : menu_.worlds.size() - 1);
  // A list that comes takes back its own trouble, and leaves that of joining to be read.
  if (error) {
    menu_.trouble = error.text;
  } else if (trouble_of_list_) {
    menu_.trouble.clear();
  }
  trouble_of_list_ = static_cast<bool>(error);
  menu_.listed = !error;
}

void App::Join(const std::string& instance) {
  instance_ = instance;
  screen_ = Screen::kJoining;
  menu_.trouble.clear();
  trouble_of_list_ = false;
  end_.clear();
  tessera::Options options;
  options.control_address = menu_.address;
  options.instance_id = instance;
  // It is good for one try, however that ends. Pasted, it may have come with spaces.
  std::istringstream(std::exchange(menu_.ticket, "")) >> options.ticket;
  if (options.ticket.empty()) options.player_name = menu_.player_name;
  options.deadline = kJoinDeadline;
  joining_ = std::async(std::launch::async, [options] {
    Joining joining;
    joining.error = joining.client.Join(options);
    return joining;
  });
}

void App::TakeJoined() {
  if (!IsReady(joining_)) return;
  Joining joined = joining_.get();
  if (joined.error) {
    menu_.trouble = joined.error.text;
    screen_ = Screen::kMenu;
    return;
  }
  client_.emplace(std::move(joined.client));
  profiler_ = Profiler();
}

void App::BackToMenu() {
  world_.reset();
  if (client_) client_->Leave(kLeaveDeadline);
  client_.reset();
  end_.clear();
  menu_.trouble.clear();
  screen_ = Screen::kMenu;
  list_due_s_ = 0;
}

void App::Take(const SDL_Event& event) {
  const ImGuiIO& io = ImGui::GetIO();
  const bool is_key = event.type == SDL_KEYDOWN || event.type == SDL_KEYUP;
  if (is_key && io.WantTextInput) return;
  if (screen_ == Screen::kWorld && !(event.type == SDL_MOUSEMOTION && io.WantCaptureMouse)) hands_.Take(event);
  if (event.type == SDL_CONTROLLERDEVICEADDED && screen_ != Screen::kWorld) hands_.Take(event);
  if (event.type != SDL_KEYDOWN) return;
  const SDL_Keycode key = event.key.keysym.sym;
  if (screen_ == Screen::kMenu) {
    if (key == SDLK_F5) list_due_s_ = 0;
    if (key == SDLK_UP && menu_.chosen > 0) --menu_.chosen;
    if (key == SDLK_DOWN && menu_.chosen + 1 < menu_.worlds.size()) ++menu_.chosen;
    if (key == SDLK_RETURN && menu_.chosen < menu_.worlds.size()) Join(menu_.worlds[menu_.chosen].id);
  } else if (key == SDLK_ESCAPE && screen_ != Screen::kJoining) {
    hands_.LetGo();
    BackToMenu();
  } else if (key == SDLK_TAB) {
    profiler_shown_ = !profiler_shown_;
  }
}

void App::Play(double now_s, float seconds, int width, int height) {
  const tessera::Error error = client_->Poll();
  client_->TakeEvents();
  client_->TakeGameEvents();
  switch (client_->state()) {
    case TESSERA_JOINING:
      screen_ = Screen::kJoining;
      break;
    case TESSERA_WAITING:
      screen_ = Screen::kWaiting;
      break;
    case TESSERA_PLAYING:
      screen_ = Screen::kWorld;
      break;
    default:
      if (screen_ != Screen::kEnded) {
        const std::string reason = client_->DisconnectReason();
        end_ = error ? (reason.empty() ? error.text : reason) : "";
      }
      screen_ = Screen::kEnded;
      break;
  }
  if (screen_ == Screen::kWorld) {
    hands_.Advance(std::min(seconds, kLongestTurn_s));
    client_->Steer(hands_.Steer(client_->Scene()));
  }
  // The scene is here once the regions have sent it.
  const bool has_scene = screen_ == Screen::kWaiting || screen_ == Screen::kWorld;
  if (has_scene && (visuals_.Advance() || !world_)) world_.emplace(renderer_, visuals_, *client_);
  if (world_) {
    renderer_.Draw(world_->Look(*client_, hands_, seconds), width, height);
  } else {
    renderer_.Draw(Picture{}, width, height);
  }
  for (const std::string& problem : visuals_.TakeProblems()) {
    std::fprintf(stderr, "tessera-desktop: %s\n", problem.c_str());
    notice_ = problem;
  }
  profiler_.Sample(now_s, *client_);
}

void App::Frame(double now_s, float seconds, int width, int height) {
  TakeWorlds();
  TakeJoined();
  if (client_) {
    Play(now_s, seconds, width, height);
  } else {
    renderer_.Draw(Picture{}, width, height);
  }
  bool back = false;
  switch (screen_) {
    case Screen::kMenu: {
      AskForWorlds(now_s);
      const MenuChoice choice = ShowMenu(menu_);
      if (choice == MenuChoice::kJoin) Join(menu_.worlds[menu_.chosen].id);
      if (choice == MenuChoice::kRefresh) {
        list_due_s_ = 0;
        menu_.listed = false;
        menu_.trouble.clear();
      }
      break;
    }
    case Screen::kWaiting:
      AskForWorlds(now_s);
      back = ShowWaiting(screen_, instance_, Listed(instance_));
      break;
    case Screen::kJoining:
      back = ShowWaiting(screen_, instance_, nullptr) && client_.has_value();
      break;
    case Screen::kWorld:
      ShowHud(client_->Scene(), instance_, client_->SpectatorView().has_value(), client_->Clock().paused != 0, notice_);
      if (profiler_shown_) ShowProfiler(PanelOf(profiler_.shown()));
      break;
    case Screen::kEnded:
      back = ShowEnd(instance_, end_);
      break;
  }
  if (back) BackToMenu();
}

Shown App::shown() const {
  Shown shown;
  shown.screen = NameOf(screen_);
  shown.trouble = menu_.trouble;
  const std::vector<RegionProfile>& regions = profiler_.shown().regions;
  shown.figures = client_ && !regions.empty() &&
                  std::all_of(regions.begin(), regions.end(), [](const auto& region) { return region.reports > 1; });
  if (screen_ == Screen::kMenu && !menu_.listed && menu_.trouble.empty()) shown.screen = "asking";
  const tessera::InstanceInfo* listed = Listed(instance_);
  shown.listed = client_ && listed != nullptr && listed->players > 0;
  if (world_) {
    shown.own_position = world_->own_position();
    shown.camera_arrived = world_->camera_arrived();
  }
  if (client_) {
    shown.tick = tessera_tick(client_->get());
    shown.ticks_per_second = client_->Scene().tick_rate_hz;
  }
  shown.meshes = world_ && !visuals_.coming();
  return shown;
}

std::string App::Report() const {
  const Shown now = shown();
  std::string text = "screen " + now.screen + "\ntrouble " + now.trouble + "\n";
  if (const tessera::InstanceInfo* listed = Listed(instance_)) {
    text += "players " + std::to_string(listed->players) + " of " + std::to_string(listed->expected_players) + ":";
    for (std::uint32_t i = 0; i < listed->name_count; ++i) text += std::string(" ") + listed->player_names[i];
    text += "\n";
  }
  if (now.own_position) {
    char line[120];
    const std::array<double, 3>& p = *now.own_position;
    std::snprintf(line, sizeof line, "own %.3f %.3f %.3f\n", p[0], p[1], p[2]);
    text += line;
  }
  if (client_) text += Text(PanelOf(profiler_.shown())) + Text(profiler_.figures());
  return text;
}

}  // namespace desktop
