// tessera scene validate
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "local_cluster/command_error.h"
#include "local_cluster/scene_file.h"

namespace tessera::cli {
namespace {

void Validate(const Globals& globals, const std::vector<std::string>& files) {
  std::string failures;
  auto report = nlohmann::ordered_json::array();
  for (const std::string& file : files) {
    try {
      const LoadedScene loaded = local::LoadScene(file);
      const auto dynamic = std::count_if(loaded.scene->bodies.begin(), loaded.scene->bodies.end(),
                                         [](const BodyDef& body) { return body.motion == Motion::kDynamic; });
      report.push_back({{"file", file},
                        {"name", loaded.scene->name},
                        {"hash", loaded.hash},
                        {"bodies", loaded.scene->bodies.size()},
                        {"dynamic", dynamic},
                        {"joints", loaded.scene->joints.size()}});
      if (globals.format == Format::kTable || globals.format == Format::kWide) {
        std::cout << fmt::format("{}: valid, {} bodies ({} dynamic), {} joints\n", file, loaded.scene->bodies.size(),
                                 dynamic, loaded.scene->joints.size());
      }
    } catch (const local::CommandError& error) {
      failures += (failures.empty() ? "" : "\n") + std::string(error.what());
    }
  }
  if (globals.format == Format::kJson) std::cout << report.dump(2) << "\n";
  if (!failures.empty()) throw local::CommandError(failures);
}

}  // namespace

void AddSceneCommands(CLI::App& app, Globals& globals) {
  auto files = std::make_shared<std::vector<std::string>>();
  CLI::App* scene = app.add_subcommand("scene", "Worlds to run")->require_subcommand(1);
  CLI::App* validate = scene->add_subcommand("validate", "Check scene files (textproto or JSON)");
  validate->add_option("files", *files, "Scene files")->required();
  validate->callback([&globals, files] { Validate(globals, *files); });
}

}  // namespace tessera::cli
