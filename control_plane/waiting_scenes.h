// WaitingScenes: large scenes that were uploaded and wait for the requests that make worlds of them.
//
// A scene that is too large for a request comes before it, in pieces, into a draft on the disk, and is named by its
// hash (SceneHash). A world that is made of it takes its bytes into the store, as one whose scene came inside of the
// request, and from then on they stay for as long as an instance needs them. What waits here goes after a grace, or
// with this control plane: whoever makes a world then sends it again.
//
//   auto place = scenes.Begin(hash, size, now);         // room on its way
//   if (absl::Status status = scenes.Keep(*place, std::move(draft), now); !status.ok()) return status;
//   const auto bytes = scenes.Bytes(hash, now);         // for a world, any number of times
//   scenes.Sweep(now);
//
// Thread rule: any thread.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "control_plane/draft_file.h"
#include "control_plane/now.h"

namespace tessera::control {

class WaitingScenes {
 public:
  // `quota`: bytes of all that wait or come; `grace`: how long one waits from the last time that it was asked for.
  WaitingScenes(std::uint64_t quota, std::chrono::nanoseconds grace) : quota_(quota), grace_(grace) {}

  // Room for a scene that comes, given back when it ends.
  class Place {
   public:
    Place(Place&& other) noexcept
        : scenes_(std::exchange(other.scenes_, nullptr)), hash_(std::move(other.hash_)), size_(other.size_) {}
    Place& operator=(Place&&) = delete;
    ~Place();

   private:
    friend class WaitingScenes;
    Place(WaitingScenes& scenes, std::string hash, std::uint64_t size)
        : scenes_(&scenes), hash_(std::move(hash)), size_(size) {}

    WaitingScenes* scenes_;
    std::string hash_;
    std::uint64_t size_;
  };

  // ALREADY_EXISTS: it waits here, and does so for another grace. INVALID_ARGUMENT names the field. RESOURCE_EXHAUSTED:
  // those that wait leave no room for it.
  absl::StatusOr<Place> Begin(const std::string& hash, std::uint64_t size, Steady now);
  // Keeps what came. INVALID_ARGUMENT: it has another size, or another hash.
  absl::Status Keep(const Place& place, DraftFile draft, Steady now);
  // NOT_FOUND: none of that hash waits. DATA_LOSS: the disk does not give it back.
  absl::StatusOr<std::string> Bytes(const std::string& hash, Steady now);
  // Drops those whose grace is over.
  void Sweep(Steady now);

  // The sum of all that wait or come.
  std::uint64_t bytes() const;

 private:
  struct Waiting {
    std::shared_ptr<const DraftFile> file;
    Steady asked_for{0};
  };

  const std::uint64_t quota_;
  const std::chrono::nanoseconds grace_;
  mutable std::mutex mutex_;  // guards all below
  std::map<std::string, Waiting> scenes_;
  std::uint64_t bytes_ = 0;
};

}  // namespace tessera::control
