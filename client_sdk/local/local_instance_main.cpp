// Runs a scene for as long as it is let, for trials of clients that are programs of their own: writes a grant for a
// player to each file named, prints "ready", then goes on by the clock.
//
//   tessera_local_instance SCENE GRANT_FILE...
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "client_sdk/local/local_world.h"

namespace {

int Fail(const std::string& why) {
  std::fprintf(stderr, "%s\n", why.c_str());
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  const std::span<char*> arguments(argv, static_cast<std::size_t>(argc));
  if (arguments.size() < 3) return Fail("usage: tessera_local_instance SCENE GRANT_FILE...");
  const std::string scene = arguments[1];
  std::ifstream text(scene);
  if (!text) return Fail(scene + ": cannot be read");
  const auto world =
      tessera::local::LocalWorld::Open({.scene = {std::istreambuf_iterator<char>(text), {}}, .scene_name = scene});
  if (!world.ok()) return Fail(std::string(world.status().message()));
  for (const std::string file : arguments.subspan(2)) {
    const auto grant = (*world)->Grant();
    if (!grant.ok()) return Fail(std::string(grant.status().message()));
    std::ofstream out(file, std::ios::binary);
    out.write(reinterpret_cast<const char*>(grant->data()), static_cast<std::streamsize>(grant->size()));
    if (!out.flush()) return Fail(file + ": cannot be written");
  }
  std::puts("ready");
  std::fflush(stdout);
  for (;; std::this_thread::sleep_for(std::chrono::milliseconds(1))) {
    const absl::Status advanced = (*world)->Advance(std::chrono::steady_clock::now());
    if (!advanced.ok()) return Fail(std::string(advanced.message()));
  }
}
