#include "options.h"

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>

namespace desktop {

const char kUsage[] =
    "Usage: tessera-desktop [--control ADDRESS] [--instance ID] [--name NAME] [--ticket FILE] [--size WxH]\n"
    "                       [--plain] [--page ADDRESS]\n"
    "\n"
    "Shows a world, and moves a player in it.\n"
    "\n"
    "  --control ADDRESS     HOST:PORT#FINGERPRINT of a players' door in JSON, or unix:PATH (default: tessera up)\n"
    "  --instance ID         joins this world at once\n"
    "  --name NAME           shown to others (default player)\n"
    "  --ticket FILE         plays by the ticket in it, which says the name and is good for one try\n"
    "  --size WxH            of the window (default 1280x720)\n"
    "  --plain               no shadows and no smooth edges, for a machine without a graphics card\n"
    "  --page ADDRESS        of a gateway, http://HOST:PORT: the meshes of imported levels come from there\n"
    "  --visuals FOLDER      with the meshes that tessera scene import wrote, which is looked at first\n"
    "  --frames N            ends after so many frames\n"
    "  --screenshot FILE     writes the last of them as a PNG file\n"
    "  --script FILE         does what the file says; samples/desktop/script.h has the steps\n"
    "\n"
    "Ends with 0 if all went well, 1 without a window, 2 for wrong arguments, 3 if no world could be listed or "
    "joined,\n"
    "or the one that was joined ended in an error.\n";

namespace {

// The ticket in the file, without what stands around it; `error` says why there is none.
std::string TicketIn(const std::string& file, std::string& error) {
  std::ifstream in(file);
  std::string ticket;
  if (!in) {
    error = "--ticket: " + file + " cannot be read";
  } else if (!(in >> ticket)) {
    error = "--ticket: " + file + " has no ticket in it";
  }
  return ticket;
}

}  // namespace

Options ParseOptions(int argc, char** argv) {
  Options options;
  for (int i = 1; i < argc && options.error.empty(); ++i) {
    const std::string name = argv[i];
    if (name == "--help" || name == "-h") {
      options.help = true;
      continue;
    }
    if (name == "--plain") {
      options.plain = true;
      continue;
    }
    const bool known = name == "--control" || name == "--instance" || name == "--name" || name == "--size" ||
                       name == "--frames" || name == "--screenshot" || name == "--script" || name == "--visuals" ||
                       name == "--page" || name == "--ticket";
    if (!known) {
      options.error = "no option " + name;
    } else if (i + 1 == argc) {
      options.error = name + " needs a value";
    } else {
      const std::string value = argv[++i];
      if (name == "--control") options.control = value;
      if (name == "--instance") options.instance = value;
      if (name == "--name") options.name = value;
      if (name == "--screenshot") options.screenshot = value;
      if (name == "--script") options.script = value;
      if (name == "--visuals") options.visuals = value;
      if (name == "--page") options.page = value;
      if (name == "--ticket") options.ticket = TicketIn(value, options.error);
      char rest = 0;
      if (name == "--frames" &&
          (std::sscanf(value.c_str(), "%ld%c", &options.frames, &rest) != 1 || options.frames < 1)) {
        options.error = "--frames: not a number from 1: " + value;
      }
      if (name == "--size") {
        const int read = std::sscanf(value.c_str(), "%dx%d%c", &options.width, &options.height, &rest);
        const bool fits =
            options.width >= 320 && options.width <= 7680 && options.height >= 240 && options.height <= 4320;
        if (read != 2 || !fits) options.error = "--size: not 320x240 to 7680x4320: " + value;
      }
    }
  }
  if (options.error.empty() && !options.screenshot.empty() && options.frames == 0) {
    options.error = "--screenshot needs --frames: it is the last that is taken";
  }
  return options;
}

}  // namespace desktop
