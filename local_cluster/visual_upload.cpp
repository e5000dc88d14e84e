#include "local_cluster/visual_upload.h"

#include <fmt/format.h>

#include <chrono>
#include <filesystem>

#include "core/world/limits.h"
#include "core/world/scene_visuals.h"
#include "core/world/sha256.h"
#include "host/files.h"
#include "local_cluster/connection.h"

namespace tessera::local {
namespace {

constexpr char kWhat[] = "meshes of the scene";
constexpr std::size_t kVisualPieceBytes = 64 << 10;
// 64 MiB take so long over a line of 1 Mbit/s.
constexpr std::chrono::minutes kSendPatience{10};
constexpr std::chrono::seconds kAskPatience{10};

std::vector<std::string> FindMissing(Connection& connection, const std::vector<std::string>& files) {
  v1::FindMissingVisualsRequest request;
  request.mutable_sha256()->Assign(files.begin(), files.end());
  v1::FindMissingVisualsResponse response;
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + kAskPatience);
  const grpc::Status status = connection.visuals().FindMissingVisuals(&context, request, &response);
  if (status.error_code() == grpc::StatusCode::UNIMPLEMENTED) return {};  // its release knows of none
  connection.Check(status, kWhat);
  return {response.sha256().begin(), response.sha256().end()};
}

std::string ReadVisual(const std::string& path, const std::string& sha256) {
  auto bytes = host::ReadFile(path, kMaxVisualFile_bytes);
  if (absl::IsNotFound(bytes.status())) {
    throw CommandError(
        fmt::format("{}: {} is missing, and the control plane does not have it; --visuals names the folder that "
                    "`tessera scene import` put it into",
                    kWhat, path));
  }
  if (!bytes.ok()) throw CommandError(fmt::format("{}: {}", kWhat, std::string(bytes.status().message())));
  if (Sha256Hex(*bytes) != sha256) {
    throw CommandError(fmt::format("{}: {} is damaged: it has another hash; import the level again", kWhat, path));
  }
  return *std::move(bytes);
}

void SendVisual(Connection& connection, const std::string& sha256, const std::string& bytes) {
  v1::PutVisualRequest first;
  first.set_sha256(sha256);
  first.set_size(bytes.size());
  connection.Send(kWhat, connection.visuals(), &v1::VisualService::Stub::PutVisual, first, bytes, kVisualPieceBytes,
                  kSendPatience);
}

}  // namespace

std::string VisualsBeside(const std::string& scene_path) {
  return (std::filesystem::path(scene_path).parent_path() / "visuals").string();
}

std::vector<SentVisual> SendVisuals(Connection& connection, const v1::Scene& scene, const std::string& folder,
                                    VisualSending sending) {
  std::vector<SentVisual> sent;
  const std::vector<std::string> files = VisualFiles(scene);
  if (files.empty()) return sent;
  for (const std::string& sha256 : FindMissing(connection, files)) {
    const std::string path = (std::filesystem::path(folder) / (sha256 + ".glb")).string();
    const std::string bytes = ReadVisual(path, sha256);
    if (sending == VisualSending::kSend) SendVisual(connection, sha256, bytes);
    sent.push_back({path, bytes.size()});
  }
  return sent;
}

}  // namespace tessera::local
