#include "agent/scene_cache.h"

#include <spdlog/spdlog.h>

#include <chrono>
#include <utility>

#include "absl/strings/str_cat.h"
#include "agent/limits.h"
#include "core/world/scene_io.h"
#include "host/files.h"
#include "telemetry/logging.h"
#include "tessera/v1/scene.pb.h"

namespace tessera::agent {
namespace {

bool MayPass(const absl::Status& status) {
  return absl::IsUnavailable(status) || absl::IsDeadlineExceeded(status) || absl::IsCancelled(status) ||
         absl::IsAborted(status) || absl::IsResourceExhausted(status);
}

}  // namespace

absl::Status CheckScene(const std::string& bytes, const std::string& hash) {
  v1::Scene scene;
  if (!scene.ParseFromString(bytes)) return absl::InvalidArgumentError("is no scene");
  if (const std::string got = SceneHash(scene); got != hash) {
    return absl::InvalidArgumentError(absl::StrCat("has hash ", got));
  }
  return absl::OkStatus();
}

absl::Status KeepScene(const std::string& bytes, const std::string& hash, const std::string& path) {
  if (absl::Status status = CheckScene(bytes, hash); !status.ok()) {
    return absl::InvalidArgumentError(absl::StrCat("what the control plane sent ", status.message()));
  }
  if (absl::Status status = host::WriteFile(path, bytes, host::Durability::kSurvivesMachine); !status.ok()) {
    return absl::InternalError(status.message());
  }
  return absl::OkStatus();
}

SceneCache::SceneCache(std::shared_ptr<EventLoop> loop, const StateDir& state, Callbacks callbacks)
    : loop_(std::move(loop)), state_(state), callbacks_(std::move(callbacks)) {}

void SceneCache::Want(const std::string& hash) {
  const std::string path = state_.ScenePath(hash);
  const absl::StatusOr<std::string> kept = host::ReadFile(path, kMaxMessageBytes);
  const absl::Status status = kept.ok() ? CheckScene(*kept, hash) : kept.status();
  if (status.ok()) return callbacks_.on_ready(hash, path);
  if (!absl::IsNotFound(status)) {
    spdlog::warn("scene damaged path={} reason={}; fetching it anew", telemetry::LogValue(path),
                 telemetry::LogValue(std::string(status.message())));
  }
  missing_.try_emplace(hash, false);
  Fetch(hash);
}

void SceneCache::Connected(std::shared_ptr<ControlLink> link, const HostIdentity& identity) {
  link_ = std::move(link);
  identity_ = identity;
  for (const auto& [hash, under_way] : missing_) Fetch(hash);
}

void SceneCache::Fetch(const std::string& hash) {
  const auto scene = missing_.find(hash);
  if (!link_ || scene == missing_.end() || scene->second) return;
  scene->second = true;
  v1::FetchSceneRequest request;
  request.set_scene_hash(hash);
  request.set_host_id(identity_.host_id());
  request.set_host_secret(identity_.host_secret());
  link_->FetchScene(request, [this, loop = loop_, hash, path = state_.ScenePath(hash)](
                                 const absl::StatusOr<std::string>& bytes) {  // on one of gRPC's threads
    absl::Status status = bytes.ok() ? KeepScene(*bytes, hash, path) : bytes.status();
    loop->Post([this, hash, status = std::move(status)] { Fetched(hash, status); });
  });
}

void SceneCache::Fetched(const std::string& hash, const absl::Status& status) {
  if (!status.ok() && MayPass(status)) {
    missing_[hash] = false;
    if (link_) loop_->RunAt(Clock::now() + kFetchRetry, [this, hash] { Fetch(hash); });
    return;
  }
  missing_.erase(hash);
  if (status.ok()) {
    spdlog::info("scene fetched hash={}", hash);
    callbacks_.on_ready(hash, state_.ScenePath(hash));
  } else {
    spdlog::error("scene refused hash={} reason={}", hash, telemetry::LogValue(std::string(status.message())));
    callbacks_.on_failed(hash, absl::StrCat("scene ", hash, ": ", status.message()));
  }
}

}  // namespace tessera::agent
