#include "control_plane/reign.h"

#include <spdlog/spdlog.h>

#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "control_plane/authority.h"
#include "control_plane/checkpoint_files.h"
#include "control_plane/cluster_mark.h"
#include "control_plane/s3/s3_target.h"
#include "control_plane/secrets.h"
#include "host/json_socket.h"
#include "host/socket_address.h"
#include "trust/certificate.h"
#include "trust/server_certificate.h"

namespace tessera::control {
namespace {

absl::StatusOr<std::unique_ptr<CheckpointFiles>> OpenCheckpoints(const ReignSettings& settings) {
  if (!settings.s3) return CheckpointFiles::Open(settings.checkpoints, settings.checkpoint_reserve);
  auto target = S3Target::Open(*settings.s3);
  if (!target.ok()) return target.status();
  return std::make_unique<CheckpointFiles>(*std::move(target));
}

// A control plane that listens on this machine alone needs none.
absl::StatusOr<std::optional<Authority>> AuthorityFor(const ReignSettings& settings, Store& store) {
  const bool https = !settings.https.listen.empty() && settings.https.certificate.empty();
  if (settings.doors.operators.empty() && settings.doors.players.empty() && !https) return std::nullopt;
  auto authority = OpenAuthority(store, settings.seal, SystemRandomBytes);
  if (!authority.ok()) return authority.status();
  spdlog::info("authority fingerprint={}", authority->fingerprint);
  return *std::move(authority);
}

// Null: there is to be none.
absl::StatusOr<std::unique_ptr<HttpsDoor>> StartHttps(const HttpsFlags& flags,
                                                      const std::optional<Authority>& authority, ControlPlane& plane,
                                                      ControlMetrics& metrics) {
  if (flags.listen.empty()) return nullptr;
  auto listen = host::ParseSocketAddress(flags.listen, host::PortRule::kFrom0);
  if (!listen.ok()) return listen.status();
  HttpsSettings settings{.listen = *std::move(listen), .certificate = {}, .key = {}};
  if (!flags.certificate.empty()) {
    auto shown =
        trust::ReadServerCertificate({"--players-certificate", flags.certificate}, {"--players-key", flags.key});
    if (!shown.ok()) return shown.status();
    settings.certificate = std::move(shown->chain);
    settings.key = std::move(shown->key);
  } else {
    auto own = trust::IssueServer(authority->signer, MakeSerial(SystemRandomBytes));
    if (!own.ok()) return own.status();
    settings.certificate = own->certificate + authority->signer.certificate;
    settings.key = std::move(own->key);
  }
  return HttpsDoor::Start(std::move(settings), plane, metrics);
}

// The same for programs of this machine, beside the control plane's socket. Null: its path would be too long.
absl::StatusOr<std::unique_ptr<HttpsDoor>> StartLocalHttps(const std::string& control_socket, ControlPlane& plane,
                                                           ControlMetrics& metrics) {
  HttpsSettings settings;
  settings.socket_path = host::JsonSocket(control_socket);
  if (settings.socket_path.size() > host::kLongestSocketPath) {
    spdlog::warn("socket={} has no room for .json: there is no players' door in JSON beside it", control_socket);
    return nullptr;
  }
  return HttpsDoor::Start(std::move(settings), plane, metrics);
}

}  // namespace

absl::StatusOr<std::unique_ptr<Reign>> Reign::Begin(Store& store, const ReignSettings& settings,
                                                    ControlMetrics& metrics, const Pages& pages, LeaderRights rights) {
  auto files = OpenCheckpoints(settings);
  if (!files.ok()) return files.status();
  absl::Status together = CheckBelongTogether(store, **files, settings.store_name, SystemRandomBytes);
  if (!together.ok()) return together;
  auto authority = AuthorityFor(settings, store);
  if (!authority.ok()) return authority.status();
  std::unique_ptr<Reign> reign(new Reign(store, metrics, pages.gate));
  auto cluster = Cluster::Load(reign->cluster_store_, settings.control, SystemRandomBytes, ControlPlane::ReadClocks());
  if (!cluster.ok()) return cluster.status();
  reign->plane_ =
      std::make_unique<ControlPlane>(reign->store_, *std::move(cluster), *std::move(files), std::move(rights));
  reign->noting_ = reign->plane_.get();
  auto https = StartHttps(settings.https, *authority, *reign->plane_, metrics);
  if (!https.ok()) return https.status();
  reign->https_ = *std::move(https);
  auto grpc = GrpcServer::Start(settings.doors, *std::move(authority), *reign->plane_, metrics);
  if (!grpc.ok()) return grpc.status();
  reign->grpc_ = *std::move(grpc);
  auto local_https = StartLocalHttps(settings.doors.socket, *reign->plane_, metrics);
  if (!local_https.ok()) return local_https.status();
  reign->local_https_ = *std::move(local_https);
  reign->gate_->Set(reign->plane_.get());
  reign->summary_ = std::make_shared<SummaryMetrics>(
      [gate = pages.gate, &metrics, last = ClusterSummary()]() mutable {
        gate->With([&](ControlPlane& plane) {
          for (const std::chrono::nanoseconds took : plane.TakeFailovers()) metrics.ObserveFailover(took);
          auto made = plane.Glance([](const Cluster& c) {
            ClusterSummary summary = Summarise(c.state(), c.revocations().number());
            summary.visual_bytes = c.visuals().bytes();
            return summary;
          });
          if (made) last = *std::move(made);
          last.stray_checkpoints = plane.stray_checkpoints();
        });
        return last;
      },
      [gate = pages.gate] {
        Revision revision = 0;
        gate->With([&](ControlPlane& plane) { revision = plane.store_revision(); });
        return revision;
      });
  pages.server.AddCollectable(reign->summary_);
  metrics.SetLeads(true);
  return reign;
}

Reign::~Reign() {
  metrics_.SetLeads(false);
  gate_->Set(nullptr);
  summary_.reset();
  if (plane_) plane_->Stop();
  noting_ = nullptr;
}

}  // namespace tessera::control
