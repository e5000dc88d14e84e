// The player's hands: keys, mouse and gamepad as one steering, and where the camera looks.
//
//   W A S D or left stick   move                   arrows, mouse with a button held, right stick   look
//   space or pad's A        jump (button 0)        shift or pad's left trigger                     run (button 1)
//
// Thread rule: one thread. Time comes in.
#pragma once

#include <SDL.h>

#include <array>
#include <set>

#include "tessera/tessera.hpp"

namespace desktop {

class Hands {
 public:
  Hands() = default;
  ~Hands();
  Hands(const Hands&) = delete;
  Hands& operator=(const Hands&) = delete;

  void Take(const SDL_Event& event);
  // Turns the camera by the keys and the stick that are held.
  void Advance(float seconds);
  // In a scene of characters the move vector, the look and the buttons; else a force the way the camera looks, as
  // strong as the scene allows.
  tessera::Steering Steer(const tessera::SceneInfo& scene) const;
  // Lets go of everything: the window has lost the keyboard.
  void LetGo();

  float yaw() const { return yaw_; }
  float pitch() const { return pitch_; }
  float distance_m() const { return distance_m_; }

 private:
  bool Held(SDL_Scancode key) const { return keys_.count(key) > 0; }
  float Axis(SDL_Scancode less, SDL_Scancode more, SDL_GameControllerAxis stick) const;
  void Look(float yaw, float pitch);

  std::set<SDL_Scancode> keys_;
  std::array<float, SDL_CONTROLLER_AXIS_MAX> sticks_{};  // -1 to 1
  std::set<int> pad_buttons_;
  SDL_GameController* pad_ = nullptr;
  float yaw_ = 0, pitch_ = -0.35F, distance_m_ = 9;
};

}  // namespace desktop
