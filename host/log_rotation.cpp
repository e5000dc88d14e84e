#include "host/log_rotation.h"

#include <sys/stat.h>

#include <cstdio>

namespace tessera::host {

std::string EarlierLog(const std::string& path, int number) { return path + "." + std::to_string(number); }

bool IsEarlierLogOf(const std::string& path, const std::string& current) {
  for (int number = 1; number <= kEarlierLogs; ++number) {
    if (path == EarlierLog(current, number)) return true;
  }
  return false;
}

bool RotateLogIfLarge(const std::string& path) {
  struct stat found {};
  if (stat(path.c_str(), &found) != 0 || !S_ISREG(found.st_mode)) return false;
  if (static_cast<std::uint64_t>(found.st_size) < kMaxLogBytes) return false;
  for (int number = kEarlierLogs; number > 1; --number) {
    (void)std::rename(EarlierLog(path, number - 1).c_str(), EarlierLog(path, number).c_str());
  }
  return std::rename(path.c_str(), EarlierLog(path, 1).c_str()) == 0;
}

}  // namespace tessera::host
