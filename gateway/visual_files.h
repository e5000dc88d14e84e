// VisualFiles: the meshes that worlds are drawn with, files by their SHA-256.
//
// Each is `<sha256>.glb` in a folder, as `tessera scene import` writes it, or else is fetched. It is read when somebody
// first asks for it, on a thread of this class, and given out only if its content has that hash. The newest that were
// asked for are kept in memory, kKept_bytes of them.
//
//   VisualFiles files("visuals", wake, [&](const std::string& sha256) { return source.Get(sha256); });
//   files.Ask(sha256, [](const VisualFiles::Answer& file) { if (file.ok()) Send(**file); });
//   loop: files.Finish();   // answers
//
// Thread rule: one thread. `wake` is called from another one when there is something to finish.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "gateway/background.h"

namespace tessera::gateway {

// Gives a file with that hash, or why not; waits. Called from several threads.
using VisualFetch = std::function<absl::StatusOr<std::string>(const std::string& sha256)>;

class VisualFiles {
 public:
  using File = std::shared_ptr<const std::string>;
  // NOT_FOUND: there is no such file. DATA_LOSS: it has another hash. RESOURCE_EXHAUSTED: it is larger than
  // kMaxVisualFile_bytes, or too many wait. Others are those of fetching.
  using Answer = absl::StatusOr<File>;
  using Done = std::function<void(const Answer&)>;

  static constexpr std::size_t kKept_bytes = std::size_t{256} << 20;
  // A file that is damaged, or could not be fetched, is not tried again for so long, whoever asks.
  static constexpr std::chrono::seconds kTryAgain{5};

  // Without a folder all are fetched; without `fetch` none is.
  VisualFiles(std::string folder, std::function<void()> wake, VisualFetch fetch = nullptr);

  // `done` is called before this returns, or by Finish.
  void Ask(const std::string& sha256, Done done);
  void Finish() { background_.Finish(); }

 private:
  struct Kept {
    File file;
    std::uint64_t used = 0;
  };
  struct Failed {
    absl::Status why;
    std::chrono::steady_clock::time_point until;
  };
  void Take(const std::string& sha256, const Answer& answer);
  void Keep(const std::string& sha256, const File& file);
  void Remember(const std::string& sha256, const absl::Status& why);

  std::string folder_;
  VisualFetch fetch_;
  std::map<std::string, Kept> kept_;
  std::map<std::string, Failed> failed_;
  std::map<std::string, std::vector<Done>> asked_;
  std::size_t kept_bytes_ = 0;
  std::uint64_t uses_ = 0;
  Background background_;  // last: its threads end first
};

}  // namespace tessera::gateway
