// tessera scene validate | import | upload
#include <fmt/format.h>
#include <google/protobuf/util/json_util.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/contexts.h"
#include "cli/gltf/gltf_import.h"
#include "cli/table.h"
#include "core/world/scene_load.h"
#include "core/world/scene_warnings.h"
#include "host/files.h"
#include "local_cluster/command_error.h"
#include "local_cluster/connection.h"
#include "local_cluster/scene_file.h"
#include "local_cluster/visual_upload.h"

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
      const std::vector<std::string> warnings = SceneWarnings(*loaded.scene);
      report.push_back({{"file", file},
                        {"name", loaded.scene->name},
                        {"hash", loaded.hash},
                        {"bodies", loaded.scene->bodies.size()},
                        {"dynamic", dynamic},
                        {"joints", loaded.scene->joints.size()},
                        {"warnings", warnings}});
      if (globals.format == Format::kTable || globals.format == Format::kWide) {
        std::cout << fmt::format("{}: valid, {} bodies ({} dynamic), {} joints\n", file, loaded.scene->bodies.size(),
                                 dynamic, loaded.scene->joints.size());
      }
      for (const std::string& warning : warnings) std::cerr << fmt::format("{}: warning: {}\n", file, warning);
    } catch (const local::CommandError& error) {
      failures += (failures.empty() ? "" : "\n") + std::string(error.what());
    }
  }
  if (globals.format == Format::kJson) std::cout << report.dump(2) << "\n";
  if (!failures.empty()) throw local::CommandError(failures);
}

struct ImportOptions {
  std::string file, out, name, visuals;
  bool no_visuals = false;
};

constexpr std::size_t kMaxLevelBytes = std::size_t{1} << 30;

void WriteScene(const v1::Scene& scene, const std::string& file) {
  if (file.ends_with(local::kSerialisedEnding)) {
    local::OrThrow(host::WriteFile(file, scene.SerializeAsString(), host::Durability::kSurvivesProcess));
    return;
  }
  google::protobuf::util::JsonPrintOptions print;
  print.add_whitespace = true;
  print.preserve_proto_field_names = true;
  std::string json;
  if (const auto status = google::protobuf::util::MessageToJsonString(scene, &json, print); !status.ok()) {
    throw local::CommandError(fmt::format("{}: {}", file, status.message().as_string()));
  }
  local::OrThrow(host::WriteFile(file, json, host::Durability::kSurvivesProcess));
}

// Keeps the meshes that are drawn, under their hash; gives the file, empty if there is none.
std::string WriteVisuals(const GltfImport& imported, const ImportOptions& options) {
  if (imported.visual_file.empty()) return "";
  const std::filesystem::path beside = std::filesystem::path(options.out).parent_path() / "visuals";
  const std::filesystem::path folder = options.visuals.empty() ? beside : std::filesystem::path(options.visuals);
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw local::CommandError(fmt::format("{}: {}", folder.string(), error.message()));
  const std::string file = (folder / (imported.visual_sha256 + ".glb")).string();
  local::OrThrow(host::WriteFile(file, imported.visual_file, host::Durability::kSurvivesProcess));
  // Everybody who may watch is given it, and a gateway may run as another user.
  using std::filesystem::perms;
  std::filesystem::permissions(file, perms::group_read | perms::others_read, std::filesystem::perm_options::add, error);
  if (error) throw local::CommandError(fmt::format("{}: {}", file, error.message()));
  return file;
}

void DropVisuals(GltfImport& imported) {
  for (v1::Body& body : *imported.scene.mutable_bodies()) body.mutable_shape()->clear_visuals();
  imported.visual_file.clear();
  imported.visual_sha256.clear();
  imported.drawn_triangles = 0;
}

void Import(const Globals& globals, const ImportOptions& options) {
  const std::filesystem::path path(options.file);
  const std::string bytes = local::OrThrow(host::ReadFile(options.file, kMaxLevelBytes));
  auto imported = ImportGltf({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()},
                             path.parent_path().string(), options.name.empty() ? path.stem().string() : options.name);
  if (!imported.ok())
    throw local::CommandError(fmt::format("{}: {}", options.file, std::string(imported.status().message())));
  if (options.no_visuals) DropVisuals(*imported);
  // A control plane will take the file that is written.
  const auto loaded = LoadScene(imported->scene, options.file);
  if (!loaded.ok()) throw local::CommandError(std::string(loaded.status().message()));
  const std::string visuals = WriteVisuals(*imported, options);
  WriteScene(imported->scene, options.out);
  const Aabb& bounds = loaded->scene->bounds;
  if (globals.format == Format::kJson) {
    std::cout << nlohmann::ordered_json{{"file", options.out},
                                        {"name", imported->scene.name()},
                                        {"nodes", imported->nodes},
                                        {"static", imported->static_bodies},
                                        {"dynamic", imported->dynamic_bodies},
                                        {"kinematic", imported->kinematic_bodies},
                                        {"triggers", imported->triggers},
                                        {"triangles", imported->triangles},
                                        {"spawn_points", imported->spawn_points},
                                        {"visuals", visuals},
                                        {"drawn_triangles", imported->drawn_triangles},
                                        {"notes", imported->notes}}
                     .dump(2)
              << "\n";
    return;
  }
  std::cout << FormatTable(
      {{"NODES", "STATIC", "DYNAMIC", "KINEMATIC", "TRIGGERS", "TRIANGLES", "SPAWNS", "SIZE"},
       {std::to_string(imported->nodes), std::to_string(imported->static_bodies),
        std::to_string(imported->dynamic_bodies), std::to_string(imported->kinematic_bodies),
        std::to_string(imported->triggers), std::to_string(imported->triangles), std::to_string(imported->spawn_points),
        fmt::format("{:g} x {:g} x {:g} m", bounds.max.x - bounds.min.x, bounds.max.y - bounds.min.y,
                    bounds.max.z - bounds.min.z)}});
  for (const std::string& note : imported->notes) std::cout << note << "\n";
  if (!visuals.empty()) {
    std::cout << fmt::format("{} triangles to draw, in {}, which goes to the control plane with the world\n",
                             imported->drawn_triangles, visuals);
  }
  std::cout << fmt::format("written to {}; try: tessera instance create --scene {} --wait\n", options.out, options.out);
}

// For a world that is there already: one that was restored by a backup, or imported.
void Upload(const Globals& globals, const ImportOptions& options) {
  const LoadedScene loaded = local::LoadScene(options.file);
  local::Connection connection = Connect(globals);
  const std::string folder = options.visuals.empty() ? local::VisualsBeside(options.file) : options.visuals;
  const auto sent = local::SendVisuals(connection, loaded.message, folder);
  if (globals.format == Format::kJson) {
    auto report = nlohmann::ordered_json::array();
    for (const auto& [file, bytes] : sent) report.push_back({{"file", file}, {"bytes", bytes}});
    std::cout << report.dump(2) << "\n";
    return;
  }
  for (const auto& [file, bytes] : sent) {
    std::cout << fmt::format("{}: {:.1f} MB sent\n", file, static_cast<double>(bytes) / 1e6);
  }
  if (sent.empty()) std::cout << fmt::format("{}: nothing to send\n", options.file);
}

}  // namespace

void AddSceneCommands(CLI::App& app, Globals& globals) {
  auto files = std::make_shared<std::vector<std::string>>();
  CLI::App* scene = app.add_subcommand("scene", "Worlds to run")->require_subcommand(1);
  CLI::App* validate = scene->add_subcommand("validate", "Check scene files (textproto, JSON, or serialised in .pb)");
  validate->add_option("files", *files, "Scene files")->required();
  validate->callback([&globals, files] { Validate(globals, *files); });
  auto import = std::make_shared<ImportOptions>();
  CLI::App* level = scene->add_subcommand("import", "Make a scene of a glTF 2.0 level (.glb or .gltf)");
  level->add_option("file", import->file, "The level")->required();
  level->add_option("out", import->out, "The scene that is to be written: as JSON, or serialised where it ends in .pb")
      ->required();
  level->add_option("--name", import->name, "Name of the scene (default: that of the level's file)");
  level->add_option("--visuals", import->visuals,
                    "Folder for the meshes that are drawn, each file under its SHA-256 (default: visuals, beside the "
                    "scene)");
  level->add_flag("--no-visuals", import->no_visuals, "Keep no meshes: the shapes are drawn");
  level->callback([&globals, import] { Import(globals, *import); });
  CLI::App* upload = scene->add_subcommand(
      "upload", "Send the control plane the meshes of a scene that it lacks, for a world that is there already");
  upload->add_option("file", import->file, "The scene")->required();
  upload->add_option("--visuals", import->visuals, "Folder of the meshes (default: visuals, beside the scene)");
  upload->callback([&globals, import] { Upload(globals, *import); });
}

}  // namespace tessera::cli
