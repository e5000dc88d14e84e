#include "agent/state_files.h"

#include <spdlog/spdlog.h>

#include <chrono>
#include <filesystem>
#include <system_error>
#include <utility>

#include "absl/strings/str_cat.h"
#include "agent/limits.h"
#include "core/world/sha256.h"
#include "host/files.h"
#include "telemetry/logging.h"

namespace tessera::agent {
namespace {

using telemetry::LogValue;

// Any thread.
absl::Status Keep(const absl::StatusOr<std::string>& bytes, const FetchState& wanted) {
  if (!bytes.ok()) return bytes.status();
  if (const std::string hash = Sha256Hex(*bytes); hash != wanted.hash) {
    return absl::InvalidArgumentError(absl::StrCat("what the control plane sent has hash ", hash));
  }
  const absl::Status status = host::WriteFile(wanted.path, *bytes, host::Durability::kSurvivesMachine);
  return status.ok() ? status : absl::InternalError(status.message());
}

// UNAUTHENTICATED is of a call that showed the certificate before this one; a host that counts no more loses its
// stream.
bool Helps(const absl::Status& status) {
  return !absl::IsNotFound(status) && !absl::IsDataLoss(status) && !absl::IsInvalidArgument(status) &&
         !absl::IsInternal(status);
}

}  // namespace

StateFiles::StateFiles(std::shared_ptr<EventLoop> loop, Callbacks callbacks)
    : loop_(std::move(loop)), callbacks_(std::move(callbacks)) {}

void StateFiles::Connected(std::shared_ptr<ControlLink> link, const HostIdentity& identity) {
  link_ = std::move(link);
  identity_ = identity;
  for (const auto& [key, missing] : missing_) Fetch(key);
}

void StateFiles::Want(const FetchState& wanted) {
  missing_.insert_or_assign(wanted.key, Missing{.wanted = wanted});
  if (!std::exchange(logs_progress_, true)) loop_->RunAt(Clock::now() + kProgressInterval, [this] { LogProgress(); });
  Fetch(wanted.key);
}

void StateFiles::LogProgress() {
  logs_progress_ = !missing_.empty();
  if (!logs_progress_) return;
  for (const auto& [key, missing] : missing_) {
    const auto waited = std::chrono::duration_cast<std::chrono::seconds>(Clock::now() - missing.since);
    spdlog::info("state still being fetched worker={} tick={} seconds={} last_failure={}", LogValue(key.ToString()),
                 missing.wanted.tick, waited.count(), LogValue(missing.failure));
  }
  loop_->RunAt(Clock::now() + kProgressInterval, [this] { LogProgress(); });
}

void StateFiles::Fetch(const WorkerKey& key) {
  const auto found = missing_.find(key);
  if (!link_ || found == missing_.end() || found->second.under_way) return;
  found->second.under_way = true;
  const FetchState wanted = found->second.wanted;
  v1::FetchStateRequest request;
  request.set_host_id(identity_.host_id());
  request.set_host_secret(identity_.host_secret());
  request.set_instance_id(key.instance_id);
  request.set_region(key.region);
  request.set_tick(wanted.tick);
  link_->FetchState(request, [this, loop = loop_, wanted](const absl::StatusOr<std::string>& bytes) {
    absl::Status status = Keep(bytes, wanted);
    loop->Post([this, key = wanted.key, status = std::move(status)] { Fetched(key, status); });
  });
}

void StateFiles::Fetched(const WorkerKey& key, const absl::Status& status) {
  const auto found = missing_.find(key);
  if (found == missing_.end()) return;
  if (!status.ok() && Helps(status)) {
    found->second.under_way = false;
    found->second.failure = std::string(status.message());
    loop_->RunAt(Clock::now() + kFetchRetry, [this, key] { Fetch(key); });
    return;
  }
  const FetchState wanted = found->second.wanted;
  missing_.erase(found);
  if (status.ok()) {
    spdlog::info("state fetched worker={} tick={}", LogValue(key.ToString()), wanted.tick);
    return callbacks_.on_ready(key, wanted.path);
  }
  callbacks_.on_failed(key, absl::StrCat("state of tick ", wanted.tick, ": ", status.message()));
}

void StateFiles::Forget(const WorkerKey& key, const std::string& folder) {
  missing_.erase(key);
  std::error_code ignored;
  std::filesystem::remove_all(StateFolderOf(folder, key), ignored);
}

void StateFiles::Upload(const UploadState& what) {
  const auto remove = [path = what.path] {
    std::error_code ignored;
    std::filesystem::remove(path, ignored);
  };
  auto bytes = host::ReadFile(what.path, kMaxStateBytes);
  if (!bytes.ok() || !link_) {
    spdlog::warn("checkpoint not sent worker={} tick={} reason={}", LogValue(what.key.ToString()), what.tick,
                 LogValue(bytes.ok() ? "the control plane is away" : std::string(bytes.status().message())));
    return remove();
  }
  v1::UploadCheckpointRequest request;
  request.set_host_id(identity_.host_id());
  request.set_host_secret(identity_.host_secret());
  *request.mutable_identity() = IdentityOf(what.key);
  request.set_tick(what.tick);
  request.set_size(bytes->size());
  request.set_hash(Sha256Hex(*bytes));
  link_->UploadCheckpoint(request, *std::move(bytes), [remove, what](const absl::Status& status) {
    spdlog::log(status.ok() ? spdlog::level::info : spdlog::level::warn, "checkpoint sent worker={} tick={} result={}",
                LogValue(what.key.ToString()), what.tick, LogValue(status.ok() ? "OK" : std::string(status.message())));
    remove();
  });
}

}  // namespace tessera::agent
