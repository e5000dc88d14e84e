// The commands of `tessera`, one function a group. Each adds its subcommands to `app`; a chosen one runs as CLI11
// parses and throws CommandError when it cannot do what it was asked.
#pragma once

#include "cli/output.h"

namespace CLI {
class App;
}

namespace tessera::cli {

void AddAccessCommands(CLI::App& app, Globals& globals);
void AddIssuerCommands(CLI::App& app, Globals& globals);
void AddPlayerCommands(CLI::App& app, Globals& globals);
void AddHostCommands(CLI::App& app, Globals& globals);
void AddInstanceCommands(CLI::App& app, Globals& globals);
// To `tessera instance`.
void AddInstanceChangeCommands(CLI::App& instance, Globals& globals);
void AddInstanceClockCommands(CLI::App& instance, Globals& globals);
void AddSceneCommands(CLI::App& app, Globals& globals);
// To `tessera game`.
void AddGameCommands(CLI::App& game, Globals& globals);
void AddGameLogCommand(CLI::App& game, Globals& globals);
void AddGameBackendCommands(CLI::App& game, Globals& globals);
void AddClientCommand(CLI::App& app, Globals& globals);
void AddSwarmCommand(CLI::App& app, Globals& globals);
void AddRecordCommands(CLI::App& app, Globals& globals);
void AddUpCommand(CLI::App& app, Globals& globals);
void AddDemoCommand(CLI::App& app, Globals& globals);

}  // namespace tessera::cli
