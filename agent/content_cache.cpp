#include "agent/content_cache.h"

#include <spdlog/spdlog.h>

#include <chrono>
#include <filesystem>
#include <system_error>
#include <utility>

#include "absl/strings/str_cat.h"
#include "agent/limits.h"
#include "host/files.h"
#include "telemetry/logging.h"

namespace tessera::agent {
namespace {

namespace fs = std::filesystem;

// UNAUTHENTICATED is of a call that showed the certificate before this one; a host that counts no more loses its
// stream.
bool MayPass(const absl::Status& status) {
  return absl::IsUnauthenticated(status) || absl::IsUnavailable(status) || absl::IsDeadlineExceeded(status) ||
         absl::IsCancelled(status) || absl::IsAborted(status) || absl::IsResourceExhausted(status);
}

}  // namespace

absl::Status KeepContent(const Content& content, const std::string& bytes, const std::string& path) {
  if (absl::Status status = CheckContent(content, bytes); !status.ok()) {
    return absl::InvalidArgumentError(absl::StrCat("what the control plane sent ", status.message()));
  }
  if (absl::Status status = host::WriteFile(path, bytes, host::Durability::kSurvivesMachine); !status.ok()) {
    return absl::InternalError(status.message());
  }
  return absl::OkStatus();
}

ContentCache::ContentCache(std::shared_ptr<EventLoop> loop, const StateDir& state, Callbacks callbacks)
    : loop_(std::move(loop)), state_(state), callbacks_(std::move(callbacks)) {}

void ContentCache::Want(const Content& content) {
  const std::string path = state_.ContentPath(content);
  unnamed_since_.erase(path);
  const absl::StatusOr<std::string> kept = host::ReadFile(path, MaxContentBytes(content.kind));
  const absl::Status status = kept.ok() ? CheckContent(content, *kept) : kept.status();
  if (status.ok()) return callbacks_.on_ready(content, path);
  if (!absl::IsNotFound(status)) {
    spdlog::warn("{} damaged path={} reason={}; fetching it anew", NameOf(content.kind), telemetry::LogValue(path),
                 telemetry::LogValue(std::string(status.message())));
  }
  missing_.try_emplace(content, false);
  Fetch(content);
}

void ContentCache::Connected(std::shared_ptr<ControlLink> link, const HostIdentity& identity) {
  link_ = std::move(link);
  identity_ = identity;
  for (const auto& [content, under_way] : missing_) Fetch(content);
}

void ContentCache::Fetch(const Content& content) {
  const auto missing = missing_.find(content);
  if (!link_ || missing == missing_.end() || missing->second) return;
  missing->second = true;
  link_->FetchContent(content, identity_,
                      [this, loop = loop_, content, path = state_.ContentPath(content)](
                          const absl::StatusOr<std::string>& bytes) {  // on one of gRPC's threads
                        absl::Status status = bytes.ok() ? KeepContent(content, *bytes, path) : bytes.status();
                        loop->Post([this, content, status = std::move(status)] { Fetched(content, status); });
                      });
}

void ContentCache::Fetched(const Content& content, const absl::Status& status) {
  if (!status.ok() && MayPass(status)) {
    missing_[content] = false;
    if (link_) loop_->RunAt(Clock::now() + kFetchRetry, [this, content] { Fetch(content); });
    return;
  }
  missing_.erase(content);
  if (status.ok()) {
    spdlog::info("{} fetched hash={}", NameOf(content.kind), content.hash);
    callbacks_.on_ready(content, state_.ContentPath(content));
  } else {
    spdlog::error("{} refused hash={} reason={}", NameOf(content.kind), content.hash,
                  telemetry::LogValue(std::string(status.message())));
    callbacks_.on_failed(content, absl::StrCat(NameOf(content.kind), " ", content.hash, ": ", status.message()));
  }
}

// A file that a call under way writes has a name of its own, and is young.
void ContentCache::RemoveUnnamed(const std::set<Content>& named, TimePoint now) {
  std::set<std::string> in_use;
  for (const Content& content : named) in_use.insert(state_.ContentPath(content));
  for (const auto& [content, under_way] : missing_) in_use.insert(state_.ContentPath(content));
  std::map<std::string, TimePoint> unnamed;
  std::size_t looked_at = 0, removed = 0;
  for (const std::string& folder : {state_.ScenesPath(), state_.GamesPath()}) {
    std::error_code error;
    for (fs::directory_iterator file(folder, error), end; !error && file != end; file.increment(error)) {
      if (++looked_at > kContentsLookedAt) break;
      std::string path = file->path().string();
      std::error_code ignored;
      if (in_use.contains(path) || !file->is_regular_file(ignored)) continue;
      const auto known = unnamed_since_.find(path);
      const TimePoint since = known == unnamed_since_.end() ? now : known->second;
      if (now - since < kContentKept || removed == kContentsRemovedAtOnce || !fs::remove(path, ignored)) {
        unnamed.emplace(std::move(path), since);
        continue;
      }
      ++removed;
      spdlog::debug("file removed path={}", telemetry::LogValue(path));
    }
  }
  if (removed > 0) spdlog::info("files removed count={} reason=\"no order names them\"", removed);
  unnamed_since_ = std::move(unnamed);
}

}  // namespace tessera::agent
