// MemoryStore: a Store that ends with its process. For tests and simulations.
#pragma once

#include <map>
#include <mutex>

#include "control_plane/store.h"

namespace tessera::control {

class MemoryStore final : public Store {
 public:
  absl::StatusOr<StoreEntry> Get(std::string_view key) const override;
  absl::StatusOr<std::vector<StoreEntry>> ListWithout(std::string_view prefix, std::string_view without) const override;
  absl::StatusOr<Revision> Txn(std::span<const StoreOp> ops) override;
  Revision revision() const override;

  // The next `count` transactions, or those after the next `passes`, fail with kUnavailable and change nothing: a full
  // disk, for tests.
  void FailNext(int count, int passes = 0);
  // How many of them are still to fail.
  int failures() const;
  // The sizes of all values that were put.
  std::size_t bytes_written() const;

 private:
  struct Versioned {
    std::string value;
    Revision revision;
  };
  mutable std::mutex mutex_;
  std::map<std::string, Versioned, std::less<>> entries_;
  Revision revision_ = 0;
  int failures_ = 0, passes_ = 0;  // those that fail, after those that do not
  std::size_t bytes_written_ = 0;
};

}  // namespace tessera::control
