// TimedStore: a store whose writes are timed. Whoever decides on the cluster waits for them, so a slow disk is felt by
// all.
//
//   TimedStore timed(store, [&](std::chrono::nanoseconds took) { metrics.ObserveWrite(took); });
//
// Thread rule: as the store, which outlives it; `observe` and `before` are called by the thread that writes. Where
// there is a `before`, one writes at a time.
#pragma once

#include <chrono>
#include <functional>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "control_plane/store.h"

namespace tessera::control {

class TimedStore final : public Store {
 public:
  using Observe = std::function<void(std::chrono::nanoseconds took)>;
  // `before` a write learns how long the last one took; 0: there was none.
  TimedStore(Store& store, Observe observe, Observe before = nullptr)
      : store_(store), observe_(std::move(observe)), before_(std::move(before)) {}

  absl::StatusOr<StoreEntry> Get(std::string_view key) const override { return store_.Get(key); }
  absl::StatusOr<std::vector<StoreEntry>> ListWithout(std::string_view prefix,
                                                      std::string_view without) const override {
    return store_.ListWithout(prefix, without);
  }
  absl::StatusOr<Revision> Txn(std::span<const StoreOp> ops) override {
    if (before_) before_(last_);
    const auto begun = std::chrono::steady_clock::now();
    absl::StatusOr<Revision> written = store_.Txn(ops);
    const std::chrono::nanoseconds took = std::chrono::steady_clock::now() - begun;
    if (before_) last_ = took;
    observe_(took);
    return written;
  }
  Revision revision() const override { return store_.revision(); }

 private:
  Store& store_;
  const Observe observe_, before_;
  std::chrono::nanoseconds last_{0};
};

}  // namespace tessera::control
