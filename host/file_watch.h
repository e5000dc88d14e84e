// FileWatch: waits for changes of a file, or of the files in a folder (inotify(7)).
//
//   FileWatch watch(folder);
//   while (!Done()) {
//     if (!watch.Wait(deadline - Clock::now())) return false;
//   }
//
// A change between construction and `Wait`, or between two calls of it, is not missed. Thread rule: one owner.
#pragma once

#include <chrono>
#include <string>

namespace tessera::host {

class FileWatch {
 public:
  // `path` exists. One that cannot be watched is never reported as changed.
  explicit FileWatch(const std::string& path);
  ~FileWatch();
  FileWatch(const FileWatch&) = delete;
  FileWatch& operator=(const FileWatch&) = delete;

  // Waits for a change, or until `descriptor`, if given, is readable. False when `timeout` is over first.
  bool Wait(std::chrono::milliseconds timeout, int descriptor = -1);

 private:
  int events_;
};

}  // namespace tessera::host
