#include "control_plane/store_flags.h"

#include "absl/strings/str_cat.h"
#include "host/socket_address.h"
#include "trust/server_certificate.h"

namespace tessera::control {
namespace {

absl::Status Wrong(const char* option, const std::string& why) {
  return absl::InvalidArgumentError(absl::StrCat(option, ": ", why));
}

// Where others reach the door that listens at `listen`; empty: there is no such door.
absl::StatusOr<std::string> Advertised(const char* option, const std::string& listen, const std::string& host) {
  if (listen.empty()) return "";
  auto address = host::ParseSocketAddress(listen, host::PortRule::kFrom0);
  if (!address.ok()) return Wrong(option, std::string(address.status().message()));
  if (address->port == 0) return Wrong(option, "with --store etcd://... it needs a port that others can know");
  if (!host.empty()) {
    address->host = host;
  } else if (address->host == "0.0.0.0" || address->host == "::") {
    return Wrong("--advertise-address", absl::StrCat(listen, " is no address that others reach; name one"));
  }
  return ToString(*address);
}

// Empty: the option was left out.
absl::StatusOr<std::string> ReadGiven(const char* option, const std::string& path) {
  if (path.empty()) return "";
  return trust::ReadPemFile({option, path});
}

}  // namespace

void AddStoreOptions(CLI::App& app, StoreFlags& flags) {
  const auto is_store = [](const std::string& text) {
    return std::string(ParseEtcdAddress(text).status().message());  // empty: fine
  };
  app.add_option(
         "--store", flags.store,
         "etcd that several control planes share, etcd://HOST:PORT,HOST:PORT/PREFIX; default a file in the state "
         "folder")
      ->check(is_store);
  app.add_option("--store-authority", flags.authority, "file with the certificate of etcd's authority, PEM");
  app.add_option("--store-certificate", flags.certificate, "file with this program's certificate for etcd, PEM");
  app.add_option("--store-key", flags.key, "file with the key of --store-certificate, PEM");
  app.add_option("--advertise-address", flags.advertise_host,
                 "host name or IP address at which others reach this control plane; default that of --listen");
}

absl::Status CheckStoreFlags(StoreFlags& flags, const std::string& listen, const std::string& players_listen,
                             const std::string& checkpoints) {
  if (flags.store.empty()) {
    for (const auto& [option, value] :
         {std::pair("--store-authority", flags.authority), std::pair("--store-certificate", flags.certificate),
          std::pair("--store-key", flags.key), std::pair("--advertise-address", flags.advertise_host)}) {
      if (!value.empty()) return Wrong(option, "only with --store etcd://...");
    }
    return absl::OkStatus();
  }
  auto etcd = ParseEtcdAddress(flags.store);
  if (!etcd.ok()) return Wrong("--store", std::string(etcd.status().message()));
  if (!flags.advertise_host.empty() && !host::IsHostName(flags.advertise_host)) {
    return Wrong("--advertise-address", absl::StrCat("\"", flags.advertise_host, "\" is no host name or IP address"));
  }
  if (flags.certificate.empty() != flags.key.empty()) {
    return Wrong(flags.key.empty() ? "--store-key" : "--store-certificate", "a certificate and its key go together");
  }
  if (flags.authority.empty() && !flags.certificate.empty()) {
    return Wrong("--store-authority", "missing: a certificate is shown over TLS alone");
  }
  if (flags.authority.empty() && !etcd->is_local) {
    return Wrong("--store-authority", "missing: etcd on another machine is reached by TLS alone");
  }
  if (checkpoints.empty()) {
    return Wrong("--checkpoints",
                 "missing: with --store etcd://... name a folder that all control planes share, or a bucket");
  }
  auto operators = Advertised("--listen", listen, flags.advertise_host);
  if (!operators.ok()) return operators.status();
  auto players = Advertised("--players-listen", players_listen, flags.advertise_host);
  if (!players.ok()) return players.status();
  flags.etcd = *std::move(etcd);
  flags.self = {.operators = *std::move(operators), .players = *std::move(players)};
  return absl::OkStatus();
}

absl::StatusOr<std::unique_ptr<EtcdClient>> ConnectStore(const StoreFlags& flags) {
  auto authority = ReadGiven("--store-authority", flags.authority);
  if (!authority.ok()) return authority.status();
  auto certificate = ReadGiven("--store-certificate", flags.certificate);
  if (!certificate.ok()) return certificate.status();
  auto key = ReadGiven("--store-key", flags.key);
  if (!key.ok()) return key.status();
  return EtcdClient::Make(
      *flags.etcd,
      {.authority = *std::move(authority), .certificate = *std::move(certificate), .key = *std::move(key)});
}

}  // namespace tessera::control
