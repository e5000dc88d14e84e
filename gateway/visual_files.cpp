#include "gateway/visual_files.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/world/limits.h"
#include "core/world/sha256.h"
#include "host/files.h"
#include "spdlog/spdlog.h"

namespace tessera::gateway {
namespace {

// Files that could not be had and are remembered; more are tried whenever they are asked for.
constexpr std::size_t kMaxFailed = 1000;
// Files at once: one that comes slowly does not keep all others waiting.
constexpr std::size_t kReaders = 4;

VisualFiles::Answer ReadVisual(const std::string& folder, const std::string& sha256) {
  const std::string name = absl::StrCat(sha256, ".glb");
  auto bytes = host::ReadFile(absl::StrCat(folder, "/", name), kMaxVisualFile_bytes);
  if (absl::IsNotFound(bytes.status())) return absl::NotFoundError(absl::StrCat("--visuals has no file ", name));
  if (!bytes.ok()) return bytes.status();
  if (Sha256Hex(*bytes) != sha256) return absl::DataLossError(absl::StrCat(name, " is damaged: it has another hash"));
  return std::make_shared<const std::string>(*std::move(bytes));
}

VisualFiles::Answer FindVisual(const std::string& folder, const VisualFetch& fetch, const std::string& sha256) {
  const VisualFiles::Answer read =
      folder.empty() ? absl::NotFoundError("there is no folder") : ReadVisual(folder, sha256);
  if (read.ok() || !fetch) return read;
  auto fetched = fetch(sha256);
  if (fetched.ok()) return std::make_shared<const std::string>(*std::move(fetched));
  return absl::IsNotFound(read.status()) ? fetched.status() : read.status();
}

}  // namespace

VisualFiles::VisualFiles(std::string folder, std::function<void()> wake, VisualFetch fetch)
    : folder_(std::move(folder)), fetch_(std::move(fetch)), background_(kReaders, std::move(wake)) {}

void VisualFiles::Ask(const std::string& sha256, Done done) {
  if (folder_.empty() && !fetch_) return done(absl::NotFoundError("this gateway has no --visuals"));
  if (const auto kept = kept_.find(sha256); kept != kept_.end()) {
    kept->second.used = ++uses_;
    return done(kept->second.file);
  }
  if (const auto failed = failed_.find(sha256); failed != failed_.end()) {
    if (std::chrono::steady_clock::now() < failed->second.until) return done(failed->second.why);
    failed_.erase(failed);
  }
  std::vector<Done>& waiting = asked_[sha256];
  waiting.push_back(std::move(done));
  if (waiting.size() > 1) return;
  const bool begun = background_.Run([this, sha256]() -> Background::Done {
    Answer answer = FindVisual(folder_, fetch_, sha256);
    return [this, sha256, answer = std::move(answer)] { Take(sha256, answer); };
  });
  if (!begun) Take(sha256, absl::ResourceExhaustedError("too many files are asked for at once"));
}

void VisualFiles::Take(const std::string& sha256, const Answer& answer) {
  if (answer.ok()) {
    Keep(sha256, *answer);
  } else if (absl::IsDataLoss(answer.status()) || fetch_) {
    Remember(sha256, answer.status());
  }
  const std::vector<Done> waiting = std::exchange(asked_[sha256], {});
  asked_.erase(sha256);
  for (const Done& done : waiting) done(answer);
}

void VisualFiles::Remember(const std::string& sha256, const absl::Status& why) {
  const auto now = std::chrono::steady_clock::now();
  if (failed_.size() >= kMaxFailed) std::erase_if(failed_, [now](const auto& one) { return one.second.until <= now; });
  if (failed_.size() >= kMaxFailed) return;
  if (!absl::IsNotFound(why)) {
    spdlog::warn("visual sha256={} problem={}", sha256, std::string(why.message()));
  }
  failed_[sha256] = {why, now + kTryAgain};
}

void VisualFiles::Keep(const std::string& sha256, const File& file) {
  kept_[sha256] = {file, ++uses_};
  kept_bytes_ += file->size();
  while (kept_bytes_ > kKept_bytes && kept_.size() > 1) {
    const auto oldest = std::min_element(kept_.begin(), kept_.end(),
                                         [](const auto& a, const auto& b) { return a.second.used < b.second.used; });
    kept_bytes_ -= oldest->second.file->size();
    kept_.erase(oldest);
  }
}

}  // namespace tessera::gateway
