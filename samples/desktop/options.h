// The options that the program was started with.
#pragma once

#include <string>

namespace desktop {

struct Options {
  std::string control, instance, name = "player";
  std::string ticket;  // the first line of a file; empty: a guest
  int width = 1280, height = 720;
  long frames = 0;  // ends after so many; 0: never
  std::string script, screenshot;
  std::string visuals;  // folder of mesh files; empty: none
  std::string page;     // address of a gateway that has them; empty: none
  bool plain = false;   // no shadows, no smooth edges
  bool help = false;
  std::string error;  // says what is wrong with the arguments
};

Options ParseOptions(int argc, char** argv);
extern const char kUsage[];

}  // namespace desktop
