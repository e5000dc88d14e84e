// TimedStore: a store whose writes are timed. Whoever decides on the cluster waits for them, so a slow disk is felt by
// all.
//
//   TimedStore timed(store, [&](std::chrono::nanoseconds took) { metrics.ObserveWrite(took); });
//
// Thread rule: as the store, which outlives it; `observe` is called by the thread that writes.
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
  TimedStore(Store& store, Observe observe) : store_(store), observe_(std::move(observe)) {}

  absl::StatusOr<StoreEntry> Get(std::string_view key) const override { return store_.Get(key); }
  absl::StatusOr<std::vector<StoreEntry>> ListWithout(std::string_view prefix,
                                                      std::string_view without) const override {
    return store_.ListWithout(prefix, without);
  }
  absl::StatusOr<Revision> Txn(std::span<const StoreOp> ops) override {
    const auto begun = std::chrono::steady_clock::now();
    absl::StatusOr<Revision> written = store_.Txn(ops);
    observe_(std::chrono::steady_clock::now() - begun);
    return written;
  }
  Revision revision() const override { return store_.revision(); }

 private:
  Store& store_;
  const Observe observe_;
};

}  // namespace tessera::control
