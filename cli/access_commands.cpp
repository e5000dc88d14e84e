// tessera cluster init | authority, tessera token create | list | revoke, tessera context add | list | use | remove
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/ascii.h"
#include "cli/checks.h"
#include "cli/commands.h"
#include "cli/contexts.h"
#include "cli/table.h"
#include "host/files.h"
#include "local_cluster/command_error.h"
#include "local_cluster/connection.h"
#include "trust/control_address.h"
#include "trust/fetch_authority.h"

namespace tessera::cli {
namespace {

constexpr std::chrono::seconds kFetchTimeout{5}, kBackupTimeout{300};
constexpr std::size_t kMaxTokenFileBytes = 1024;

struct AccessOptions {
  std::string name, role = "viewer", instances, address, token_file, file;
  double hours = 0;
};

v1::Role RoleFrom(const std::string& text) {
  v1::Role role = v1::ROLE_UNSPECIFIED;
  v1::Role_Parse("ROLE_" + absl::AsciiStrToUpper(text), &role);
  return role;
}

std::string RoleName(v1::Role role) { return absl::AsciiStrToLower(ShortName(v1::Role_Name(role), "ROLE_")); }

v1::GetAuthorityResponse AuthorityOf(local::Connection& connection) {
  return connection.Call("cluster authority", connection.access(), &v1::AccessService::Stub::GetAuthority,
                         v1::GetAuthorityRequest());
}

v1::CreateTokenResponse CreateToken(local::Connection& connection, const AccessOptions& options) {
  v1::CreateTokenRequest request;
  request.set_name(options.name);
  request.set_role(RoleFrom(options.role));
  request.set_instances(options.instances);
  if (options.hours > 0) request.mutable_ttl()->set_seconds(std::llround(options.hours * 3600));
  return connection.Call("token create", connection.access(), &v1::AccessService::Stub::CreateToken, request);
}

// --- cluster

void Init(const Globals& globals, const AccessOptions& options) {
  const auto address = trust::ParseControlAddress(options.address, host::PortRule::kFrom1);
  if (!address.ok() || address->is_socket() || !address->fingerprint.empty()) {
    throw local::CommandError(fmt::format("--address \"{}\" is not of the form HOST:PORT", options.address));
  }
  Contexts contexts = LoadContexts();
  if (contexts.by_name.contains(options.name)) {
    throw local::CommandError(fmt::format("there is a context {} already; `tessera context remove {}`, or give --name",
                                          options.name, options.name));
  }
  local::Connection connection = Connect(globals);
  v1::InitClusterRequest request;
  request.set_name(options.name);
  const auto made =
      connection.Call("cluster init", connection.access(), &v1::AccessService::Stub::InitCluster, request);
  contexts.by_name[options.name] = {
      .address = address->target(), .authority = made.certificate(), .token = made.secret()};
  contexts.current = options.name;
  SaveContexts(contexts);
  std::cout << fmt::format(
      "context {} written to {}, and in use\n"
      "authority      {}\n"
      "try: tessera host list\n"
      "let others in: tessera token create NAME --role operator, and there\n"
      "               tessera context add {} --address {}#{} --token-file FILE\n",
      options.name, ContextsPath(), made.fingerprint(), options.name, address->target(), made.fingerprint());
}

void ShowAuthority(const Globals& globals) {
  local::Connection connection = Connect(globals);
  const v1::GetAuthorityResponse authority = AuthorityOf(connection);
  std::cout << (globals.format == Format::kJson ? ToJson(authority) : authority.fingerprint() + "\n");
}

void Backup(const Globals& globals, const AccessOptions& options) {
  local::Connection connection = Connect(globals);
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + kBackupTimeout);
  const auto stream = connection.access().BackupCluster(&context, v1::BackupClusterRequest());
  v1::BackupClusterResponse piece;
  std::string bytes;
  while (stream->Read(&piece)) bytes += piece.data();
  connection.Check(stream->Finish(), "cluster backup");
  // Readable for this user alone, and whole or not at all.
  const absl::Status written = host::WriteFile(options.file, bytes, host::Durability::kSurvivesMachine);
  if (!written.ok()) throw local::CommandError(std::string(written.message()));
  v1::BackupClusterRequest nothing;
  PrintChange(globals, "cluster", options.file, fmt::format("written, {} bytes", bytes.size()), false, nothing);
  if (globals.format != Format::kTable) return;
  std::cout
      << "keep it secret, and seal.key of the control plane's state folder with it: a new control plane needs both\n"
         "to begin from it: tessera-control --state-dir DIR --restore FILE\n";
}

// --- token

void Create(const Globals& globals, const AccessOptions& options) {
  local::Connection connection = Connect(globals);
  const v1::CreateTokenResponse response = CreateToken(connection, options);
  PrintChange(globals, "token", options.name, "created", false, response);
  if (globals.format != Format::kTable) return;
  std::cout << fmt::format("secret (shown once): {}\n", response.secret());
}

void List(const Globals& globals) {
  local::Connection connection = Connect(globals);
  const auto response =
      connection.Call("token list", connection.access(), &v1::AccessService::Stub::ListTokens, v1::ListTokensRequest());
  if (globals.format == Format::kJson) {
    std::cout << ToJson(response);
    return;
  }
  std::vector<TableRow> rows{{"NAME", "ROLE", "INSTANCES", "AGE", "RUNS OUT"}};
  for (const v1::AccessToken& token : response.tokens()) {
    if (globals.format == Format::kName) std::cout << "token/" << token.name() << "\n";
    const long long age = token.has_expire_time() ? AgeSeconds(token.expire_time()) : 0;
    const std::string end = !token.has_expire_time() ? "never" : age >= 0 ? "has run out" : "in " + FormatAge(-age);
    const std::string instances = token.instances().empty() ? "all" : token.instances();
    rows.push_back({token.name(), RoleName(token.role()), instances, FormatAge(AgeSeconds(token.create_time())), end});
  }
  if (globals.format == Format::kName) return;
  if (rows.size() == 1) {
    std::cerr << "no tokens; create one with 'tessera token create NAME --role operator'\n";
    return;
  }
  std::cout << FormatTable(rows);
}

void Revoke(const Globals& globals, const AccessOptions& options) {
  local::Connection connection = Connect(globals);
  v1::RevokeTokenRequest request;
  request.set_name(options.name);
  const auto response =
      connection.Call("token revoke", connection.access(), &v1::AccessService::Stub::RevokeToken, request);
  PrintChange(globals, "token", options.name, "revoked", false, response);
}

// --- context

std::string ReadToken(const AccessOptions& options) {
  if (options.token_file.empty()) {
    const char* token = std::getenv("TESSERA_TOKEN");
    if (token == nullptr || token[0] == '\0') throw local::CommandError("give --token-file, or set TESSERA_TOKEN");
    return token;
  }
  const std::string text = local::OrThrow(host::ReadFile(options.token_file, kMaxTokenFileBytes));
  const std::string token(absl::StripAsciiWhitespace(text));
  if (token.empty()) throw local::CommandError(fmt::format("--token-file {}: is empty", options.token_file));
  return token;
}

// From the first of a cluster's control planes that answers; each has it, whoever leads.
std::string FetchFromAny(const std::vector<trust::ControlAddress>& addresses) {
  absl::StatusOr<std::string> authority;
  for (const trust::ControlAddress& address : addresses) {
    authority = trust::FetchAuthority(address.tcp, address.fingerprint, kFetchTimeout);
    if (!absl::IsUnavailable(authority.status())) break;
  }
  return local::OrThrow(std::move(authority));
}

void AddContext(const AccessOptions& options) {
  const auto addresses = local::OrThrow(trust::ParseControlAddresses(options.address, host::PortRule::kFrom1));
  std::vector<std::string> targets;
  for (const trust::ControlAddress& address : addresses) {
    if (address.is_socket() || address.fingerprint.empty()) {
      throw local::CommandError(
          fmt::format("--address \"{}\" is not of the form HOST:PORT#FINGERPRINT; "
                      "`tessera cluster authority` prints the fingerprint",
                      address.text()));
    }
    targets.push_back(address.target());
  }
  Contexts contexts = LoadContexts();
  contexts.by_name[options.name] = {.address = fmt::format("{}", fmt::join(targets, ",")),
                                    .authority = FetchFromAny(addresses),
                                    .token = ReadToken(options)};
  contexts.current = options.name;
  SaveContexts(contexts);
  std::cout << fmt::format("context {} added to {}, and in use\n", options.name, ContextsPath());
}

void ListContexts(const Globals& globals) {
  const Contexts contexts = LoadContexts();
  std::vector<TableRow> rows{{"", "NAME", "ADDRESS"}};
  for (const auto& [name, context] : contexts.by_name) {
    if (globals.format == Format::kName) std::cout << "context/" << name << "\n";
    rows.push_back({name == contexts.current ? "*" : "", name, context.address});
  }
  if (globals.format == Format::kName) return;
  if (rows.size() == 1) {
    std::cerr << "no contexts; commands go to the socket of this user's 'tessera up'\n";
    return;
  }
  std::cout << FormatTable(rows);
}

void UseContext(const AccessOptions& options) {
  Contexts contexts = LoadContexts();
  if (!options.name.empty() && !contexts.by_name.contains(options.name)) {
    throw local::CommandError(fmt::format("there is no context {}; see `tessera context list`", options.name));
  }
  contexts.current = options.name;
  SaveContexts(contexts);
  std::cout << (options.name.empty() ? "no context in use: commands go to the socket of this user's 'tessera up'\n"
                                     : fmt::format("context {} in use\n", options.name));
}

void RemoveContext(const AccessOptions& options) {
  Contexts contexts = LoadContexts();
  if (contexts.by_name.erase(options.name) == 0) {
    throw local::CommandError(fmt::format("there is no context {}; see `tessera context list`", options.name));
  }
  if (contexts.current == options.name) contexts.current.clear();
  SaveContexts(contexts);
  std::cout << fmt::format("context {} removed; its token stands until `tessera token revoke`\n", options.name);
}

}  // namespace

void AddAccessCommands(CLI::App& app, Globals& globals) {
  auto options = std::make_shared<AccessOptions>();
  CLI::App* cluster = app.add_subcommand("cluster", "The cluster itself")->require_subcommand(1);
  CLI::App* init = cluster->add_subcommand(
      "init", "Make the first administrator's token and context; on the control plane's machine, over its socket");
  init->add_option("--address", options->address, "HOST:PORT at which the control plane is reached: its --listen")
      ->required();
  init->add_option("--name", options->name, "Name of the context and the token")->default_val("admin");
  init->callback([&globals, options] { Init(globals, *options); });
  CLI::App* backup =
      cluster->add_subcommand("backup", "Write all that the control plane stores to a file, while it runs");
  backup->add_option("file", options->file, "Where to; what is there is replaced")->required();
  backup->callback([&globals, options] { Backup(globals, *options); });
  cluster->add_subcommand("authority", "Print the fingerprint of the cluster's authority")->callback([&globals] {
    ShowAuthority(globals);
  });

  CLI::App* token = app.add_subcommand("token", "Who may call the control plane")->require_subcommand(1);
  CLI::App* create = token->add_subcommand("create", "Create an access token; its secret is shown once");
  create->add_option("name", options->name, "Name of the token")->required();
  create->add_option("--role", options->role, "viewer, operator or administrator")
      ->capture_default_str()
      ->check(CLI::IsMember({"viewer", "operator", "administrator"}));
  create->add_option("--hours", options->hours, "Hours until it runs out (default: never)")
      ->check(CLI::Range(1.0 / 60, 87600.0))
      ->check(Finite());
  create->add_option(
      "--instances", options->instances,
      "The beginning of the ids of those that it is for: inst-7 for that one (default: the whole cluster)");
  create->callback([&globals, options] { Create(globals, *options); });
  token->add_subcommand("list", "List the tokens")->callback([&globals] { List(globals); });
  CLI::App* revoke = token->add_subcommand("revoke", "Revoke a token, from the next call on");
  revoke->add_option("name", options->name, "Name of the token")->required();
  revoke->callback([&globals, options] { Revoke(globals, *options); });

  CLI::App* context = app.add_subcommand("context", "The clusters that this command line knows")->require_subcommand(1);
  CLI::App* add = context->add_subcommand("add", "Add a cluster, or replace it, and use it");
  add->add_option("name", options->name, "Name of the context")->required();
  add->add_option("--address", options->address, "HOST:PORT#FINGERPRINT of the control plane")->required();
  add->add_option("--token-file", options->token_file, "A file with the token's secret (default: TESSERA_TOKEN)");
  add->callback([options] { AddContext(*options); });
  context->add_subcommand("list", "List the contexts")->callback([&globals] { ListContexts(globals); });
  CLI::App* use = context->add_subcommand("use", "Speak to this cluster from now on");
  use->add_option("name", options->name, "Name of the context; left out: this machine's socket");
  use->callback([options] { UseContext(*options); });
  CLI::App* remove = context->add_subcommand("remove", "Forget a cluster");
  remove->add_option("name", options->name, "Name of the context")->required();
  remove->callback([options] { RemoveContext(*options); });
}

}  // namespace tessera::cli
