// Downloads: files of a gateway by HTTP, which come while the picture goes on.
//
//   Downloads downloads("http://127.0.0.1:7710");
//   downloads.Begin("/visuals/5f0c...e2.glb");
//   every frame: for (Download& file : downloads.Take()) ...
//
// Thread rule: one thread; each file comes on one of its own. Destruction ends those under way.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <future>
#include <string>
#include <vector>

namespace desktop {

struct Download {
  std::string path, bytes;
  std::string problem;  // why it did not come; empty: it did
};

class Downloads {
 public:
  // `page`: as `tessera up` prints it; what stands behind a # is left out. Empty: there is no gateway. One that cannot
  // have a file now is asked again after `try_again`, a few times.
  Downloads(const std::string& page, std::size_t max_bytes,
            std::chrono::milliseconds try_again = std::chrono::seconds(2));
  ~Downloads();
  Downloads(const Downloads&) = delete;
  Downloads& operator=(const Downloads&) = delete;

  bool any() const { return !address_.empty(); }
  void Begin(const std::string& path);
  bool under_way() const { return !coming_.empty(); }
  // Those that have ended, each once.
  std::vector<Download> Take();

 private:
  Download Fetch(const std::string& path) const;

  std::string address_;  // "http://127.0.0.1:7710"
  const std::size_t max_bytes_;
  const std::chrono::milliseconds try_again_;
  std::atomic<bool> ending_{false};
  std::vector<std::future<Download>> coming_;
};

}  // namespace desktop
