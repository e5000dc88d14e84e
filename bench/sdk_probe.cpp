// sdk-probe: a program that has nothing but the client library of a folder, loaded while it runs, and says what memory
// that costs it.
//
//   sdk-probe LIBRARY            after loading
//   sdk-probe LIBRARY GRANT S    after S seconds in the world of a grant
//
// Prints the bytes that are private to it beyond those before it loaded the library.
#include <dlfcn.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "client_sdk/include/tessera/tessera.h"

namespace {

long PrivateBytes() {
  std::ifstream rollup("/proc/self/smaps_rollup");
  long kib = 0, all = 0;
  for (std::string word; rollup >> word;) {
    if (word == "Private_Clean:" || word == "Private_Dirty:") {
      rollup >> kib;
      all += kib;
    }
  }
  return all * 1024;
}

template <class Function>
Function* Of(void* library, const char* name) {
  auto* function = reinterpret_cast<Function*>(dlsym(library, name));
  if (function == nullptr) {
    std::fprintf(stderr, "sdk-probe: no %s\n", name);
    std::exit(1);
  }
  return function;
}

int Play(void* library, const char* file, int seconds) {
  std::ifstream in(file, std::ios::binary);
  const std::vector<char> grant(std::istreambuf_iterator<char>(in), {});
  const auto poll = Of<decltype(tessera_poll)>(library, "tessera_poll");
  const auto show = Of<decltype(tessera_bodies)>(library, "tessera_bodies");
  const auto now = Of<decltype(tessera_now)>(library, "tessera_now");
  tessera_grant_options options = TESSERA_GRANT_OPTIONS;
  options.bind_address = "127.0.0.1";
  tessera_client* client = nullptr;
  const auto join = Of<decltype(tessera_join_grant)>(library, "tessera_join_grant");
  if (join(grant.data(), grant.size(), &options, &client) != TESSERA_OK) {
    std::fprintf(stderr, "sdk-probe: %s\n", Of<decltype(tessera_last_error)>(library, "tessera_last_error")());
    return 1;
  }
  std::vector<tessera_body> bodies(4096, TESSERA_BODY);
  std::size_t shown = 0;
  for (int frame = 0; frame < 60 * seconds; ++frame) {
    if (poll(client, now()) != TESSERA_OK) return 1;
    shown = show(client, now(), bodies.data(), sizeof bodies[0], bodies.size());
    usleep(1'000'000 / 60);
  }
  std::printf("%zu ", shown);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2 && argc != 4) return 2;
  const long before = PrivateBytes();
  void* library = dlopen(argv[1], RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) {
    std::fprintf(stderr, "sdk-probe: %s\n", dlerror());
    return 1;
  }
  if (argc == 4 && Play(library, argv[2], std::atoi(argv[3])) != 0) return 1;
  std::printf("%ld\n", PrivateBytes() - before);
  return 0;
}
