// The screens in front of the world: menu, waiting screen, profiler, the end. Drawn by Dear ImGui; nothing here talks
// to the network.
//
// Thread rule: the thread of the OpenGL context.
#pragma once

#include <string>
#include <vector>

#include "profile.h"
#include "tessera/connect.hpp"

namespace desktop {

enum class Screen { kMenu, kJoining, kWaiting, kWorld, kEnded };

struct MenuState {
  std::string address, player_name = "player";
  std::string ticket;                         // good for one try; empty: a guest
  std::vector<tessera::InstanceInfo> worlds;  // those that can be joined
  bool listed = false;                        // an answer has come from `address`
  std::string trouble;                        // why there is no list, or why joining failed
  std::size_t chosen = 0;
};

enum class MenuChoice { kNone, kRefresh, kJoin };

void SetStyle(float scale);
MenuChoice ShowMenu(MenuState& menu);
// `world`: as the list has it; null where it is not known. True: go back.
bool ShowWaiting(Screen screen, const std::string& instance, const tessera::InstanceInfo* world);
void ShowProfiler(const Panel& panel);
// `notice`: something that could not be drawn; empty: all is.
void ShowHud(const tessera::SceneInfo& scene, const std::string& instance, bool spectating, bool paused,
             const std::string& notice);
// True: go back.
bool ShowEnd(const std::string& instance, const std::string& why);

bool CanBeJoined(const tessera::InstanceInfo& world);

}  // namespace desktop
