// tessera: the command line. Exit status 0, 1 when it could not be done, 2 for wrong usage.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <iostream>
#include <map>

#include "cli/commands.h"
#include "host/renamed_options.h"
#include "local_cluster/command_error.h"

#ifndef TESSERA_VERSION
#define TESSERA_VERSION "unknown"
#endif

namespace tessera::cli {
namespace {

int Main(int argc, char** argv) {
  if (const std::string refused = host::RefusedOption(argc, argv); !refused.empty()) {
    std::cerr << fmt::format("tessera: {}\n", refused);
    return 2;
  }
  Globals globals;
  CLI::App app{"Tessera: real-time physics worlds on many machines"};
  app.set_version_flag("--version", std::string("tessera ") + TESSERA_VERSION);
  app.require_subcommand(1);
  app.fallthrough();
  app.option_defaults()->always_capture_default(false);
  app.add_option("--control", globals.control,
                 "The control plane: unix:PATH, HOST:PORT of a context or HOST:PORT#FINGERPRINT (default: the context "
                 "in use, else the socket of this user's 'tessera up')")
      ->envname("TESSERA_CONTROL")
      ->type_name("ADDRESS");
  app.add_option("--context", globals.context, "A cluster that 'tessera context list' shows")->type_name("NAME");
  const std::map<std::string, Format> formats{
      {"table", Format::kTable}, {"wide", Format::kWide}, {"json", Format::kJson}, {"name", Format::kName}};
  app.add_option("-o,--output", globals.format, "Form of the answer: table, wide, json or name")
      ->transform(CLI::CheckedTransformer(formats))
      ->type_name("FORM");
  AddUpCommand(app, globals);
  AddAccessCommands(app, globals);
  AddIssuerCommands(app, globals);
  AddHostCommands(app, globals);
  AddInstanceCommands(app, globals);
  AddPlayerCommands(app, globals);
  AddSceneCommands(app, globals);
  CLI::App* game =
      app.add_subcommand("game", "Write, check and test games, see what they log and publish")->require_subcommand(1);
  AddGameCommands(*game, globals);
  AddGameLogCommand(*game, globals);
  AddGameBackendCommands(*game, globals);
  AddClientCommand(app, globals);
  AddSwarmCommand(app, globals);
  AddRecordCommands(app, globals);
  AddDemoCommand(app, globals);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  } catch (const local::CommandError& error) {
    std::cerr << fmt::format("tessera: {}\n", error.what());
    return 1;
  } catch (const std::exception& error) {
    std::cerr << fmt::format("tessera: internal error: {}\n", error.what());
    return 1;
  }
  return 0;
}

}  // namespace
}  // namespace tessera::cli

int main(int argc, char** argv) {
  const int exit_code = tessera::cli::Main(argc, argv);
  // Not by return: gRPC 1.51's threads may still be busy with the last connection, and abort if they find the library's
  // static objects destroyed. All that must be written is written here.
  std::cout.flush();
  _exit(exit_code);
}
