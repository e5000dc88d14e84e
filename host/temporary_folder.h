// TemporaryFolder: a folder of its own under the system's temporary one, removed with all in it at the end of its life.
#pragma once

#include <string>

namespace tessera::host {

class TemporaryFolder {
 public:
  // std::system_error, which names the folder, if it cannot be made.
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

}  // namespace tessera::host
