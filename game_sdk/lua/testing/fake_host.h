// FakeHost: a host for tests of game modules, which writes down each call as a line.
//
// Every body is here and own, is of the kind "crate" (even ids) or "player" (odd ones), and stands at (id, 0, 0). The
// properties are health (whole), speed (real), tag (text) and open (flag).
//
// Thread rule: one thread.
#pragma once

#include <string>
#include <vector>

#include "game_sdk/api/api.h"

struct tessera_game_call {
  int unused;
};

namespace tessera::game {

class FakeHost {
 public:
  // The ABI has no pointer to the host in its functions, so there is one of them at a time.
  FakeHost();
  ~FakeHost();
  FakeHost(const FakeHost&) = delete;
  FakeHost& operator=(const FakeHost&) = delete;

  tessera_game_host abi;
  tessera_game_call call{};
  std::vector<std::string> lines;  // calls of all functions but those that only read
  std::uint64_t budget = 1'000'000, work = 0;
  std::uint64_t random_calls = 0;

  int Call(std::uint32_t function, const tessera_game_value* arguments, std::uint32_t count,
           tessera_game_value* result);
  std::string error;

 private:
  int Property(std::uint32_t function, const tessera_game_value* arguments, tessera_game_value* result);
};

// "impulse(body 7, (1, 2, 3))"
std::string Describe(const tessera_game_value& value);

tessera_game_value Body(std::uint64_t id);
tessera_game_value Text(const char* text);

}  // namespace tessera::game
