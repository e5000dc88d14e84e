// RegionsInStep: the regions of a world that make their ticks together, for tests: each gets the others' frames at
// once.
#pragma once

#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <vector>

#include "core/region/region.h"

namespace tessera::region {

class RegionsInStep : public ::testing::Test {
 protected:
  void Send(const std::vector<OutgoingFrame>& frames, RegionId from) {
    for (const OutgoingFrame& frame : frames) {
      const absl::Status status = regions_.at(frame.to)->Receive(from, frame.bytes);
      ASSERT_TRUE(status.ok()) << status;
    }
  }
  void Step() {
    std::map<RegionId, StepResult> results;
    for (auto& [id, region] : regions_) {
      ASSERT_TRUE(region->CanStep());
      results[id] = region->Step();
    }
    for (auto& [id, result] : results) {
      Send(result.frames, id);
      logs[id] = result.log;
    }
  }
  void StepTo(std::uint64_t tick) {
    while (regions_.begin()->second->tick().value() < tick) ASSERT_NO_FATAL_FAILURE(Step());
  }

  std::map<RegionId, std::unique_ptr<Region>> regions_;
  std::map<RegionId, Bytes> logs;  // as each region's last tick wrote it
};

}  // namespace tessera::region
