#include "cli/contexts.h"

#include <fmt/format.h>

#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "host/files.h"
#include "local_cluster/command_error.h"
#include "local_cluster/connection.h"
#include "trust/control_address.h"

namespace tessera::cli {
namespace {

constexpr std::size_t kMaxFileBytes = 1 << 20;

std::string ConfigFolder() {
  const char* config = std::getenv("XDG_CONFIG_HOME");
  if (config != nullptr && config[0] == '/') return std::string(config) + "/tessera";
  const char* home = std::getenv("HOME");
  return std::string(home != nullptr ? home : ".") + "/.config/tessera";
}

const Context* FindByAddress(const Contexts& contexts, const std::string& address) {
  for (const auto& [name, context] : contexts.by_name) {
    if (context.address == address) return &context;
  }
  return nullptr;
}

}  // namespace

std::string ContextsPath() { return ConfigFolder() + "/contexts.json"; }

Contexts LoadContexts() {
  const std::string path = ContextsPath();
  const auto text = host::ReadFile(path, kMaxFileBytes);
  if (absl::IsNotFound(text.status())) return {};
  local::OrThrow(text.status());
  Contexts contexts;
  try {
    const auto json = nlohmann::json::parse(*text);
    contexts.current = json.value("current", "");
    for (const auto& [name, entry] : json.at("contexts").items()) {
      contexts.by_name[name] = {.address = entry.at("address").get<std::string>(),
                                .authority = entry.at("authority").get<std::string>(),
                                .token = entry.at("token").get<std::string>()};
    }
  } catch (const nlohmann::json::exception&) {
    throw local::CommandError(path + ": is not what `tessera context` wrote; mend it or move it away");
  }
  return contexts;
}

void SaveContexts(const Contexts& contexts) {
  nlohmann::ordered_json json{{"current", contexts.current}, {"contexts", nlohmann::ordered_json::object()}};
  for (const auto& [name, context] : contexts.by_name) {
    json["contexts"][name] = {{"address", context.address}, {"authority", context.authority}, {"token", context.token}};
  }
  std::error_code error;
  std::filesystem::create_directories(std::filesystem::path(ConfigFolder()).parent_path(), error);
  local::OrThrow(host::MakePrivateFolder(ConfigFolder()));
  local::OrThrow(host::WriteFile(ContextsPath(), json.dump(2) + "\n", host::Durability::kSurvivesMachine));
}

trust::ControlPoint ControlOf(const Globals& globals) {
  const Contexts contexts = LoadContexts();
  const std::string name = globals.context.empty() ? contexts.current : globals.context;
  const Context* context = nullptr;
  trust::ControlPoint point(globals.control);
  if (!point.address.empty()) {
    context = FindByAddress(contexts, point.address);
  } else if (!name.empty()) {
    const auto found = contexts.by_name.find(name);
    if (found == contexts.by_name.end()) {
      throw local::CommandError(fmt::format("--context {}: there is none; see `tessera context list`", name));
    }
    context = &found->second;
    point.address = context->address;
  } else {
    point.address = "unix:" + trust::DefaultControlSocket();
  }
  if (context != nullptr) {
    point.credentials.authority = context->authority;
    point.credentials.bearer_token = context->token;
  }
  if (const char* token = std::getenv("TESSERA_TOKEN"); token != nullptr && token[0] != '\0') {
    point.credentials.bearer_token = token;
  }
  return point;
}

local::Connection Connect(const Globals& globals) { return local::Connection(ControlOf(globals)); }

}  // namespace tessera::cli
