// Script: what a test, or somebody who wants a picture, has the client do, one step a line.
//
//   wait world          until that screen is shown: menu, joining, waiting, world, ended, trouble (the menu says why)
//   wait figures        until each region has sent its figures twice, so that a last second is known
//   wait meshes         until no mesh is on its way from a gateway
//   wait listed         until the list has the world that is being joined
//   frames 30           shows so many frames
//   press Return        a key, by SDL's name for it; hold W, release W
//   wait moved 2        until the own body is 2 m from where it was when this step began
//   wait rest           until the own body is shown at one place for a second of the world, and the camera is behind it
//   screenshot a.png    of the next frame
//   report a.txt        screen, trouble, own body and profiler, as they are shown
//   quit
//
// Keys go through SDL's queue like those of a person. Thread rule: one thread.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace desktop {

// The state that a step can wait for.
struct Shown {
  std::string screen, trouble;
  bool figures = false, listed = false, meshes = false;
  std::optional<std::array<double, 3>> own_position;
  bool camera_arrived = false;  // it looks at where the own body is
  std::uint64_t tick = 0, ticks_per_second = 0;
};

class Script {
 public:
  // Nothing, with `error` set to "file:3: no step 'jump'", if it makes no sense.
  static std::optional<Script> Read(const std::string& file, std::string& error);

  // Orders to be done in this frame, besides the keys that it presses.
  struct Orders {
    std::string screenshot, report;  // files; empty: none
    bool quit = false;
  };
  Orders Advance(const Shown& shown);

 private:
  struct Step {
    std::string verb, what;
    double number = 0;
  };
  bool Done(const Step& step, const Shown& shown);
  bool Rests(const Shown& shown);

  std::vector<Step> steps_;
  std::size_t at_ = 0;
  double frames_ = 0;  // frames of the step under way
  std::optional<std::array<double, 3>> from_;
  std::uint64_t since_tick_ = 0;  // that the own body is at `from_`, for a step that waits for rest
};

}  // namespace desktop
