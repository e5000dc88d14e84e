#include "input.h"

#include <algorithm>
#include <cmath>

namespace desktop {
namespace {

constexpr float kTurn_rad_s = 1.8F, kMouse_rad = 0.005F, kMostPitch = 1.4F;
constexpr float kDeadZone = 0.15F;  // a stick that is let go rests somewhere in it
constexpr float kNearest_m = 3, kFurthest_m = 60, kZoom = 1.15F;

}  // namespace

Hands::~Hands() {
  if (pad_ != nullptr) SDL_GameControllerClose(pad_);
}

void Hands::LetGo() {
  keys_.clear();
  pad_buttons_.clear();
  sticks_.fill(0);
}

void Hands::Look(float yaw, float pitch) {
  yaw_ = std::remainder(yaw_ + yaw, 6.2831853F);
  pitch_ = std::clamp(pitch_ + pitch, -kMostPitch, kMostPitch);
}

void Hands::Take(const SDL_Event& event) {
  switch (event.type) {
    case SDL_KEYDOWN:
      keys_.insert(event.key.keysym.scancode);
      break;
    case SDL_KEYUP:
      keys_.erase(event.key.keysym.scancode);
      break;
    case SDL_WINDOWEVENT:
      if (event.window.event == SDL_WINDOWEVENT_FOCUS_LOST) LetGo();
      break;
    case SDL_MOUSEMOTION:
      if (event.motion.state != 0) {
        Look(-kMouse_rad * static_cast<float>(event.motion.xrel), -kMouse_rad * static_cast<float>(event.motion.yrel));
      }
      break;
    case SDL_MOUSEWHEEL:
      distance_m_ =
          std::clamp(distance_m_ * std::pow(kZoom, static_cast<float>(-event.wheel.y)), kNearest_m, kFurthest_m);
      break;
    case SDL_CONTROLLERDEVICEADDED:
      if (pad_ == nullptr) pad_ = SDL_GameControllerOpen(event.cdevice.which);
      break;
    case SDL_CONTROLLERDEVICEREMOVED:
      if (pad_ != nullptr && SDL_GameControllerFromInstanceID(event.cdevice.which) == pad_) {
        SDL_GameControllerClose(pad_);
        pad_ = nullptr;
        LetGo();
      }
      break;
    case SDL_CONTROLLERAXISMOTION:
      if (event.caxis.axis < SDL_CONTROLLER_AXIS_MAX) {
        const float value = std::max(-1.0F, static_cast<float>(event.caxis.value) / 32767.0F);
        sticks_[event.caxis.axis] = std::abs(value) < kDeadZone ? 0 : value;
      }
      break;
    case SDL_CONTROLLERBUTTONDOWN:
      pad_buttons_.insert(event.cbutton.button);
      break;
    case SDL_CONTROLLERBUTTONUP:
      pad_buttons_.erase(event.cbutton.button);
      break;
    default:
      break;
  }
}

float Hands::Axis(SDL_Scancode less, SDL_Scancode more, SDL_GameControllerAxis stick) const {
  return std::clamp((Held(more) ? 1.0F : 0.0F) - (Held(less) ? 1.0F : 0.0F) + sticks_[static_cast<std::size_t>(stick)],
                    -1.0F, 1.0F);
}

void Hands::Advance(float seconds) {
  const float turn = Axis(SDL_SCANCODE_LEFT, SDL_SCANCODE_RIGHT, SDL_CONTROLLER_AXIS_RIGHTX);
  const float tilt = Axis(SDL_SCANCODE_UP, SDL_SCANCODE_DOWN, SDL_CONTROLLER_AXIS_RIGHTY);
  Look(-turn * kTurn_rad_s * seconds, -tilt * kTurn_rad_s * seconds);
}

tessera::Steering Hands::Steer(const tessera::SceneInfo& scene) const {
  float right = Axis(SDL_SCANCODE_A, SDL_SCANCODE_D, SDL_CONTROLLER_AXIS_LEFTX);
  float forward = -Axis(SDL_SCANCODE_W, SDL_SCANCODE_S, SDL_CONTROLLER_AXIS_LEFTY);
  const float length = std::hypot(right, forward);
  if (length > 1) right /= length, forward /= length;
  tessera::Steering steering = TESSERA_STEERING;
  steering.yaw = yaw_;
  steering.pitch = pitch_;
  if (Held(SDL_SCANCODE_SPACE) || pad_buttons_.count(SDL_CONTROLLER_BUTTON_A) > 0) steering.buttons |= 1;
  const bool trigger = sticks_[SDL_CONTROLLER_AXIS_TRIGGERLEFT] > 0.5F;
  if (Held(SDL_SCANCODE_LSHIFT) || Held(SDL_SCANCODE_RSHIFT) || trigger) steering.buttons |= 2;
  if (scene.character_walk_speed_m_s > 0) {
    steering.move[0] = right;
    steering.move[1] = forward;
  } else {
    const auto force = static_cast<float>(scene.player_max_force_n);
    steering.force[0] = force * (right * std::cos(yaw_) - forward * std::sin(yaw_));
    steering.force[2] = force * (-right * std::sin(yaw_) - forward * std::cos(yaw_));
  }
  return steering;
}

}  // namespace desktop
