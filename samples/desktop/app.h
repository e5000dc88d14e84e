// App: the client from its menu to the end of a world. Joining and asking for the list wait for answers, so they go on
// in threads of their own; everything else happens in Frame.
//
// Thread rule: the thread of the OpenGL context.
#pragma once

#include <future>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "input.h"
#include "options.h"
#include "profile.h"
#include "renderer.h"
#include "screens.h"
#include "script.h"
#include "visuals.h"
#include "world.h"

namespace desktop {

class App {
 public:
  App(const Options& options, Renderer& renderer);
  ~App();
  App(const App&) = delete;
  App& operator=(const App&) = delete;

  void Take(const SDL_Event& event);
  // Polls, and draws all but the user interface's own triangles, which ImGui::Render makes afterwards.
  void Frame(double now_s, float seconds, int width, int height);

  Shown shown() const;
  std::string Report() const;
  // Whether the last thing that was tried came to nothing.
  bool failed() const { return !menu_.trouble.empty() || !end_.empty(); }
  const std::string& end() const { return end_; }

 private:
  using Listing = std::pair<tessera::Error, std::vector<tessera::InstanceInfo>>;
  struct Joining {
    tessera::Error error;
    tessera::Client client;
  };

  void AskForWorlds(double now_s);
  void TakeWorlds();
  void Join(const std::string& instance);
  void TakeJoined();
  void Play(double now_s, float seconds, int width, int height);
  void BackToMenu();
  const tessera::InstanceInfo* Listed(const std::string& id) const;

  Renderer& renderer_;
  Screen screen_ = Screen::kMenu;
  MenuState menu_;
  std::vector<tessera::InstanceInfo> all_;  // as the newest list has them, those that cannot be joined too
  std::string instance_, end_;
  std::future<Listing> listing_;
  std::string listed_from_;       // the address that was asked
  bool trouble_of_list_ = false;  // the menu says why there is no list
  double list_due_s_ = 0;
  std::future<Joining> joining_;
  std::optional<tessera::Client> client_;
  Visuals visuals_;
  std::string notice_;  // the newest thing that could not be drawn
  std::optional<World> world_;
  Profiler profiler_;
  Hands hands_;
  bool profiler_shown_ = true;
};

}  // namespace desktop
