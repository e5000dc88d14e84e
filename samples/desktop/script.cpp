#include "script.h"

#include <SDL.h>

#include <array>
#include <cmath>
#include <fstream>
#include <optional>
#include <sstream>
#include <string>

namespace desktop {
namespace {

constexpr double kRests_m = 5e-3;  // a body that rests is shown within so much of one place

double Distance(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

bool IsKnown(const std::string& verb) {
  for (const char* known : {"wait", "frames", "press", "hold", "release", "screenshot", "report", "quit"}) {
    if (verb == known) return true;
  }
  return false;
}

void PushKey(const std::string& name, bool down) {
  SDL_Event event{};
  event.type = down ? SDL_KEYDOWN : SDL_KEYUP;
  event.key.state = down ? SDL_PRESSED : SDL_RELEASED;
  event.key.keysym.scancode = SDL_GetScancodeFromName(name.c_str());
  event.key.keysym.sym = SDL_GetKeyFromName(name.c_str());
  SDL_PushEvent(&event);
}

}  // namespace

std::optional<Script> Script::Read(const std::string& file, std::string& error) {
  std::ifstream in(file);
  if (!in) {
    error = file + ": cannot be read";
    return std::nullopt;
  }
  Script script;
  int number = 0;
  for (std::string line; std::getline(in, line);) {
    ++number;
    std::istringstream words(line);
    Step step;
    if (!(words >> step.verb) || step.verb[0] == '#') continue;
    words >> step.what;
    if (step.verb == "frames") words = std::istringstream(step.what);
    words >> step.number;
    const bool is_key = step.verb == "press" || step.verb == "hold" || step.verb == "release";
    if (!IsKnown(step.verb)) {
      error = file + ":" + std::to_string(number) + ": no step '" + step.verb + "'";
    } else if (is_key && SDL_GetScancodeFromName(step.what.c_str()) == SDL_SCANCODE_UNKNOWN) {
      error = file + ":" + std::to_string(number) + ": no key '" + step.what + "'";
    } else if (step.verb != "quit" && step.what.empty()) {
      error = file + ":" + std::to_string(number) + ": '" + step.verb + "' of what?";
    }
    if (!error.empty()) return std::nullopt;
    script.steps_.push_back(step);
  }
  return script;
}

bool Script::Done(const Step& step, const Shown& shown) {
  if (step.verb == "frames") return frames_ >= step.number;
  if (step.verb != "wait") return true;
  if (step.what == "figures") return shown.figures;
  if (step.what == "listed") return shown.listed;
  if (step.what == "meshes") return shown.meshes;
  if (step.what == "trouble") return !shown.trouble.empty();
  if (step.what == "rest") return Rests(shown);
  if (step.what != "moved") return shown.screen == step.what;
  if (!from_) from_ = shown.own_position;
  return from_ && shown.own_position && Distance(*from_, *shown.own_position) >= step.number;
}

// By the world's time, in which a body falls: a world that is late is waited for.
bool Script::Rests(const Shown& shown) {
  if (!from_ || !shown.own_position || Distance(*from_, *shown.own_position) > kRests_m) {
    from_ = shown.own_position;
    since_tick_ = shown.tick;
    return false;
  }
  return shown.camera_arrived && shown.tick >= since_tick_ + shown.ticks_per_second;
}

Script::Orders Script::Advance(const Shown& shown) {
  Orders orders;
  ++frames_;
  while (at_ < steps_.size() && Done(steps_[at_], shown)) {
    const Step& step = steps_[at_++];
    frames_ = 0;
    from_.reset();
    if (step.verb == "press" || step.verb == "hold") PushKey(step.what, true);
    if (step.verb == "press" || step.verb == "release") PushKey(step.what, false);
    if (step.verb == "report") orders.report = step.what;
    if (step.verb == "quit") orders.quit = true;
    if (step.verb == "screenshot") {
      orders.screenshot = step.what;
      break;  // the frame that follows is taken before anything else happens
    }
  }
  return orders;
}

}  // namespace desktop
