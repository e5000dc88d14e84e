#include "control_plane/waiting_scenes.h"

#include <sodium.h>

#include <algorithm>
#include <array>

#include "absl/strings/str_cat.h"
#include "control_plane/one_line.h"
#include "core/world/scene_load.h"

namespace tessera::control {
namespace {

constexpr std::size_t kDigitsOfAHash = 64, kHashedSceneBytes = std::size_t{1} << 20;

bool IsSceneHash(const std::string& hash) {
  return hash.size() == kDigitsOfAHash && std::all_of(hash.begin(), hash.end(), [](char digit) {
           return (digit >= '0' && digit <= '9') || (digit >= 'a' && digit <= 'f');
         });
}

// SceneHash of the bytes, if they are a scene's serialised form.
absl::StatusOr<std::string> HashOf(const DraftFile& file) {
  crypto_generichash_state sum;
  crypto_generichash_init(&sum, nullptr, 0, crypto_generichash_BYTES);
  for (std::uint64_t at = 0; at < file.size(); at += kHashedSceneBytes) {
    const auto part = file.Read(at, std::min<std::uint64_t>(file.size() - at, kHashedSceneBytes));
    if (!part.ok()) return part.status();
    crypto_generichash_update(&sum, reinterpret_cast<const unsigned char*>(part->data()), part->size());
  }
  std::array<unsigned char, crypto_generichash_BYTES> digest{};
  crypto_generichash_final(&sum, digest.data(), digest.size());
  std::string hex(2 * digest.size() + 1, '\0');
  sodium_bin2hex(hex.data(), hex.size(), digest.data(), digest.size());
  hex.pop_back();
  return hex;
}

}  // namespace

WaitingScenes::Place::~Place() {
  if (scenes_ == nullptr) return;
  const std::lock_guard lock(scenes_->mutex_);
  scenes_->bytes_ -= size_;
}

absl::StatusOr<WaitingScenes::Place> WaitingScenes::Begin(const std::string& hash, std::uint64_t size, Steady now) {
  if (!IsSceneHash(hash)) {
    return absl::InvalidArgumentError("scene_hash: must be 64 lower-case hexadecimal digits");
  }
  if (size < 1 || size > kMaxSceneBytes) {
    return absl::InvalidArgumentError(absl::StrCat("size: ", size, " bytes are not in 1 to ", kMaxSceneBytes));
  }
  const std::lock_guard lock(mutex_);
  if (const auto found = scenes_.find(hash); found != scenes_.end()) {
    found->second.asked_for = now;
    return absl::AlreadyExistsError(absl::StrCat("scene_hash: ", hash, " is here"));
  }
  if (size > quota_ - std::min(quota_, bytes_)) {
    return absl::ResourceExhaustedError(absl::StrCat("size: the scenes that wait for their worlds have ", bytes_,
                                                     " bytes, at most ", quota_, "; try again later"));
  }
  bytes_ += size;
  return Place(*this, hash, size);
}

absl::Status WaitingScenes::Keep(const Place& place, DraftFile draft, Steady now) {
  if (draft.size() != place.size_) {
    return absl::InvalidArgumentError(absl::StrCat("data: ended after ", draft.size(), " of ", place.size_, " bytes"));
  }
  const auto hash = HashOf(draft);
  if (!hash.ok()) return hash.status();
  if (*hash != place.hash_) return absl::InvalidArgumentError("data: what came has another hash than was said");
  const std::lock_guard lock(mutex_);
  // Two may have sent the same; the place of each ends with its call.
  const auto [at, is_new] = scenes_.try_emplace(place.hash_);
  at->second.asked_for = now;
  if (!is_new) return absl::OkStatus();
  bytes_ += draft.size();
  at->second.file = std::make_shared<const DraftFile>(std::move(draft));
  return absl::OkStatus();
}

absl::StatusOr<std::string> WaitingScenes::Bytes(const std::string& hash, Steady now) {
  std::shared_ptr<const DraftFile> file;
  {
    const std::lock_guard lock(mutex_);
    const auto found = scenes_.find(hash);
    if (found == scenes_.end()) {
      return absl::NotFoundError(absl::StrCat("no scene ", OneLine(hash, kDigitsOfAHash + 1), " waits here"));
    }
    found->second.asked_for = now;
    file = found->second.file;
  }
  return file->Read(0, file->size());
}

void WaitingScenes::Sweep(Steady now) {
  const std::lock_guard lock(mutex_);
  std::erase_if(scenes_, [&](const auto& entry) {
    const bool over = now - entry.second.asked_for > grace_;
    if (over) bytes_ -= entry.second.file->size();
    return over;
  });
}

std::uint64_t WaitingScenes::bytes() const {
  const std::lock_guard lock(mutex_);
  return bytes_;
}

}  // namespace tessera::control
