// A native client of Tessera on its public library alone: SDL2, OpenGL 3.3 core, Dear ImGui.
#include <SDL.h>
#include <imgui.h>
#include <imgui_impl_opengl3.h>
#include <imgui_impl_sdl.h>
#include <stb_image_write.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "app.h"
#include "gl.h"
#include "options.h"
#include "renderer.h"
#include "screens.h"
#include "script.h"

namespace {

using namespace desktop;

constexpr int kOk = 0, kNoWindow = 1, kUsageError = 2, kNoWorld = 3;

// The window with its OpenGL context and Dear ImGui in it.
class Window {
 public:
  Window(int width, int height, bool smooth) {
    if (SDL_Init(SDL_INIT_VIDEO | SDL_INIT_GAMECONTROLLER) != 0) return;
    SDL_GL_SetAttribute(SDL_GL_CONTEXT_MAJOR_VERSION, 3);
    SDL_GL_SetAttribute(SDL_GL_CONTEXT_MINOR_VERSION, 3);
    SDL_GL_SetAttribute(SDL_GL_CONTEXT_PROFILE_MASK, SDL_GL_CONTEXT_PROFILE_CORE);
    SDL_GL_SetAttribute(SDL_GL_DEPTH_SIZE, 24);
    SDL_GL_SetAttribute(SDL_GL_MULTISAMPLEBUFFERS, smooth ? 1 : 0);
    SDL_GL_SetAttribute(SDL_GL_MULTISAMPLESAMPLES, smooth ? 4 : 0);
    constexpr Uint32 kFlags = SDL_WINDOW_OPENGL | SDL_WINDOW_RESIZABLE | SDL_WINDOW_ALLOW_HIGHDPI;
    const auto open = [&] {
      window_ = SDL_CreateWindow("Tessera", SDL_WINDOWPOS_CENTERED, SDL_WINDOWPOS_CENTERED, width, height, kFlags);
    };
    open();
    if (window_ == nullptr) {  // not every display has smooth edges
      SDL_GL_SetAttribute(SDL_GL_MULTISAMPLEBUFFERS, 0);
      SDL_GL_SetAttribute(SDL_GL_MULTISAMPLESAMPLES, 0);
      open();
    }
    if (window_ != nullptr) context_ = SDL_GL_CreateContext(window_);
    if (context_ == nullptr) return;
    SDL_GL_SetSwapInterval(1);
    ImGui::CreateContext();
    SetStyle(1);
    ImGui_ImplSDL2_InitForOpenGL(window_, context_);
    ImGui_ImplOpenGL3_Init("#version 330 core");
  }
  ~Window() {
    if (context_ != nullptr) {
      ImGui_ImplOpenGL3_Shutdown();
      ImGui_ImplSDL2_Shutdown();
      ImGui::DestroyContext();
      SDL_GL_DeleteContext(context_);
    }
    if (window_ != nullptr) SDL_DestroyWindow(window_);
    SDL_Quit();
  }
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  bool open() const { return context_ != nullptr; }
  void Begin(int* width, int* height) {
    ImGui_ImplOpenGL3_NewFrame();
    ImGui_ImplSDL2_NewFrame();
    ImGui::NewFrame();
    SDL_GL_GetDrawableSize(window_, width, height);
  }
  void DrawInterface() {
    ImGui::Render();
    ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
  }
  void Swap() { SDL_GL_SwapWindow(window_); }

 private:
  SDL_Window* window_ = nullptr;
  SDL_GLContext context_ = nullptr;
};

bool WritePicture(const std::string& file, int width, int height) {
  std::vector<unsigned char> pixels(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 3);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadBuffer(GL_BACK);
  glReadPixels(0, 0, width, height, GL_RGB, GL_UNSIGNED_BYTE, pixels.data());
  stbi_flip_vertically_on_write(1);
  return stbi_write_png(file.c_str(), width, height, 3, pixels.data(), 3 * width) != 0;
}

int Fail(int code, const std::string& why) {
  std::fprintf(stderr, "tessera-desktop: %s\n", why.c_str());
  return code;
}

int Run(const Options& options, std::optional<Script> script) {
  Window window(options.width, options.height, !options.plain);
  if (!window.open()) return Fail(kNoWindow, std::string("no window with OpenGL 3.3: ") + SDL_GetError());
  Gl gl;
  if (const char* missing = gl.Load()) return Fail(kNoWindow, std::string("the OpenGL driver lacks ") + missing);
  Renderer renderer(gl, !options.plain);
  if (!renderer.error().empty()) return Fail(kNoWindow, "shaders: " + renderer.error());
  App app(options, renderer);

  const double per_second = static_cast<double>(SDL_GetPerformanceFrequency());
  double before_s = static_cast<double>(SDL_GetPerformanceCounter()) / per_second;
  for (long frame = 1;; ++frame) {
    Script::Orders orders;
    if (script) orders = script->Advance(app.shown());
    for (SDL_Event event; SDL_PollEvent(&event) != 0;) {
      if (event.type == SDL_QUIT) orders.quit = true;
      ImGui_ImplSDL2_ProcessEvent(&event);
      app.Take(event);
    }
    const double now_s = static_cast<double>(SDL_GetPerformanceCounter()) / per_second;
    int width = 0, height = 0;
    window.Begin(&width, &height);
    app.Frame(now_s, static_cast<float>(std::min(now_s - before_s, 1.0)), width, height);
    before_s = now_s;
    window.DrawInterface();
    if (frame == options.frames) orders.quit = true;
    const std::string picture = !orders.screenshot.empty() ? orders.screenshot
                                : frame == options.frames  ? options.screenshot
                                                           : "";
    if (!picture.empty() && !WritePicture(picture, width, height))
      return Fail(kUsageError, picture + ": cannot be written");
    if (!orders.report.empty() && !(std::ofstream(orders.report) << app.Report())) {
      return Fail(kUsageError, orders.report + ": cannot be written");
    }
    window.Swap();
    if (orders.quit) break;
  }
  if (!app.failed()) return kOk;
  const Shown shown = app.shown();
  return Fail(kNoWorld, shown.trouble.empty() ? "the world ended: " + app.end() : shown.trouble);
}

}  // namespace

int main(int argc, char** argv) {
  const Options options = ParseOptions(argc, argv);
  if (options.help) {
    std::fputs(kUsage, stdout);
    return kOk;
  }
  if (!options.error.empty()) return Fail(kUsageError, options.error + "; --help says what there is");
  std::optional<Script> script;
  if (!options.script.empty()) {
    std::string error;
    script = Script::Read(options.script, error);
    if (!script) return Fail(kUsageError, error);
  }
  return Run(options, std::move(script));
}
