// tessera issuer create | add | list | remove, tessera ticket sign
#include <fmt/format.h>
#include <sodium.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <iostream>
#include <memory>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/numbers.h"
#include "cli/commands.h"
#include "cli/contexts.h"
#include "cli/table.h"
#include "host/files.h"
#include "local_cluster/command_error.h"
#include "local_cluster/connection.h"
#include "trust/ticket.h"
#include "trust/ticket_key.h"

namespace tessera::cli {
namespace {

constexpr std::size_t kMaxKeyFileBytes = 4096;

struct IssuerOptions {
  std::string name, instances, key_out, public_key;
};

struct TicketOptions {
  std::string key, cluster, player, instance = "any", name;
  std::vector<std::string> properties;
  std::uint32_t lifetime_s = 60;
  std::uint64_t number = 0;
};

void StartSodium() {
  if (sodium_init() < 0) throw local::CommandError("libsodium cannot be initialised");
}

void AddIssuer(const Globals& globals, const IssuerOptions& options, const trust::TicketPublicKey& key) {
  local::Connection connection = Connect(globals);
  v1::AddIssuerRequest request;
  request.set_name(options.name);
  request.set_public_key(std::string(key.begin(), key.end()));
  request.set_instances(options.instances);
  const auto response =
      connection.Call("issuer add", connection.access(), &v1::AccessService::Stub::AddIssuer, request);
  PrintChange(globals, "issuer", options.name, "added", false, response);
  if (globals.format != Format::kTable) return;
  std::cout << fmt::format("cluster {}\n", absl::BytesToHexString(response.cluster_id()));
}

// The file comes first: an issuer whose key nobody has is of no use, and one that is there is never overwritten.
void CreateIssuer(const Globals& globals, const IssuerOptions& options) {
  StartSodium();
  if (std::filesystem::exists(options.key_out)) {
    throw local::CommandError(fmt::format("--key-out {}: is there already", options.key_out));
  }
  trust::TicketSeed seed{};
  randombytes_buf(seed.data(), seed.size());
  const std::string pem = local::OrThrow(trust::TicketKeyPem(seed));
  local::OrThrow(host::WriteFile(options.key_out, pem, host::Durability::kSurvivesMachine));
  try {
    AddIssuer(globals, options, trust::PublicKeyOf(seed));
  } catch (...) {
    std::error_code ignored;
    std::filesystem::remove(options.key_out, ignored);
    throw;
  }
}

void AddIssuerOfFile(const Globals& globals, const IssuerOptions& options) {
  const std::string pem = local::OrThrow(host::ReadFile(options.public_key, kMaxKeyFileBytes));
  const auto key = trust::ReadTicketPublicKey(pem);
  if (!key.ok())
    throw local::CommandError(
        fmt::format("--public-key {}: {}", options.public_key, std::string(key.status().message())));
  AddIssuer(globals, options, *key);
}

void ListIssuers(const Globals& globals) {
  local::Connection connection = Connect(globals);
  const auto response = connection.Call("issuer list", connection.access(), &v1::AccessService::Stub::ListIssuers,
                                        v1::ListIssuersRequest());
  if (globals.format == Format::kJson) {
    std::cout << ToJson(response);
    return;
  }
  std::vector<TableRow> rows{{"NAME", "INSTANCES", "AGE", "PUBLIC KEY"}};
  for (const v1::Issuer& issuer : response.issuers()) {
    if (globals.format == Format::kName) std::cout << "issuer/" << issuer.name() << "\n";
    rows.push_back({issuer.name(), issuer.instances().empty() ? "all" : issuer.instances(),
                    FormatAge(AgeSeconds(issuer.create_time())), absl::BytesToHexString(issuer.public_key())});
  }
  if (globals.format == Format::kName) return;
  if (rows.size() == 1) {
    std::cerr << "no issuers; create one with 'tessera issuer create NAME --key-out FILE'\n";
    return;
  }
  std::cout << FormatTable(rows) << fmt::format("cluster {}\n", absl::BytesToHexString(response.cluster_id()));
}

void RemoveIssuer(const Globals& globals, const IssuerOptions& options) {
  local::Connection connection = Connect(globals);
  v1::RemoveIssuerRequest request;
  request.set_name(options.name);
  const auto response =
      connection.Call("issuer remove", connection.access(), &v1::AccessService::Stub::RemoveIssuer, request);
  PrintChange(globals, "issuer", options.name, "removed", false, response);
}

// --- ticket

// "team=red", "score=3", "pace=1.5", "armed=true": a value is what it reads as; "=" and quotes make a text of any.
NamedProperty PropertyFrom(const std::string& text) {
  const std::size_t at = text.find('=');
  if (at == 0 || at == std::string::npos) {
    throw local::CommandError(fmt::format("--property \"{}\" is not of the form NAME=VALUE", text));
  }
  const std::string name = text.substr(0, at), value = text.substr(at + 1);
  std::int64_t number = 0;
  double real = 0;
  if (value == "true" || value == "false") return {name, value == "true"};
  if (absl::SimpleAtoi(value, &number)) return {name, number};
  if (absl::SimpleAtod(value, &real)) return {name, real};
  const bool quoted = value.size() >= 2 && value.front() == '"' && value.back() == '"';
  return {name, quoted ? value.substr(1, value.size() - 2) : value};
}

// The cluster's id, as it was given, or as the cluster says.
std::string ClusterOf(const Globals& globals, const TicketOptions& options) {
  std::string id;
  if (options.cluster.empty()) {
    local::Connection connection = Connect(globals);
    id = connection
             .Call("ticket sign", connection.access(), &v1::AccessService::Stub::ListIssuers, v1::ListIssuersRequest())
             .cluster_id();
    if (id.empty()) throw local::CommandError("the cluster has no issuer yet; see `tessera issuer create`");
    return id;
  }
  const bool hexadecimal = std::all_of(options.cluster.begin(), options.cluster.end(),
                                       [](unsigned char c) { return absl::ascii_isxdigit(c); });
  if (!hexadecimal || options.cluster.size() != 2 * trust::TicketCluster().size()) {
    throw local::CommandError(fmt::format("--cluster \"{}\" is not 32 hexadecimal digits", options.cluster));
  }
  return absl::HexStringToBytes(options.cluster);
}

void SignTicket(const Globals& globals, const TicketOptions& options) {
  StartSodium();
  const std::string pem = local::OrThrow(host::ReadFile(options.key, kMaxKeyFileBytes));
  const auto seed = trust::ReadTicketKey(pem);
  if (!seed.ok())
    throw local::CommandError(fmt::format("--key {}: {}", options.key, std::string(seed.status().message())));
  const std::string cluster = ClusterOf(globals, options);
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  trust::Ticket ticket;
  std::copy_n(cluster.begin(), ticket.cluster.size(), ticket.cluster.begin());
  ticket.issued_at = std::chrono::floor<std::chrono::milliseconds>(now);
  ticket.lifetime = std::chrono::seconds(options.lifetime_s);
  ticket.number = options.number != 0
                      ? options.number
                      : static_cast<std::uint64_t>(std::chrono::floor<std::chrono::microseconds>(now).count());
  if (options.instance != "any") ticket.instance = options.instance;
  ticket.player_id = options.player;
  ticket.name = options.name;
  for (const std::string& property : options.properties) ticket.properties.push_back(PropertyFrom(property));
  std::cout << local::OrThrow(trust::SignTicket(std::move(ticket), *seed)) << "\n";
}

}  // namespace

void AddIssuerCommands(CLI::App& app, Globals& globals) {
  auto options = std::make_shared<IssuerOptions>();
  CLI::App* issuer = app.add_subcommand("issuer", "Whose tickets players join with")->require_subcommand(1);
  CLI::App* create = issuer->add_subcommand("create", "Make a key for a game's backend, and believe what it signs");
  CLI::App* add = issuer->add_subcommand("add", "Believe what the holder of a key signs");
  for (CLI::App* command : {create, add}) {
    command->add_option("name", options->name, "Name of the issuer")->required();
    command->add_option(
        "--instances", options->instances,
        "The beginning of the ids of those that its tickets are for: inst-7 for that one (default: all)");
  }
  create->add_option("--key-out", options->key_out, "File for the private key (PEM, Ed25519), which must not be there")
      ->required();
  create->callback([&globals, options] { CreateIssuer(globals, *options); });
  add->add_option("--public-key", options->public_key, "File with the public key (PEM, Ed25519)")->required();
  add->callback([&globals, options] { AddIssuerOfFile(globals, *options); });
  issuer->add_subcommand("list", "List the issuers, and the cluster's id")->callback([&globals] {
    ListIssuers(globals);
  });
  CLI::App* remove = issuer->add_subcommand("remove", "Refuse an issuer's tickets, from the next one on");
  remove->add_option("name", options->name, "Name of the issuer")->required();
  remove->callback([&globals, options] { RemoveIssuer(globals, *options); });

  auto ticket_options = std::make_shared<TicketOptions>();
  CLI::App* ticket = app.add_subcommand("ticket", "Who players are, as a game's backend says")->require_subcommand(1);
  CLI::App* sign = ticket->add_subcommand("sign", "Print a ticket, as a game's backend would make it");
  sign->add_option("--key", ticket_options->key, "File with an issuer's private key (PEM, Ed25519)")->required();
  sign->add_option("--player", ticket_options->player, "The player's id, 1 to 64 bytes")->required();
  sign->add_option("--instance", ticket_options->instance, "Id of the instance that it is for, or any")
      ->capture_default_str();
  sign->add_option("--name", ticket_options->name, "The player's name, shown to others");
  sign->add_option("--property", ticket_options->properties,
                   "NAME=VALUE that the player's body begins with; may be given several times");
  sign->add_option("--lifetime", ticket_options->lifetime_s, "Seconds until it runs out, 1 to 300")
      ->capture_default_str()
      ->check(CLI::Range(1, 300));
  sign->add_option("--number", ticket_options->number,
                   "Higher than that of the player's tickets before (default: microseconds of the clock)");
  sign->add_option("--cluster", ticket_options->cluster,
                   "The cluster's id, as 'tessera issuer list' shows it (default: ask the control plane)");
  sign->callback([&globals, ticket_options] { SignTicket(globals, *ticket_options); });
}

}  // namespace tessera::cli
