// AwakeJoints: the joints that hold an awake body, with their rows for this step.
//
// Promise: joints ascend by id, each once, whatever the order of bodies.
// Thread rule: one thread at a time.
#pragma once

#include <span>
#include <vector>

#include "core/physics/body_store.h"

namespace tessera::physics {

class AwakeJoints {
 public:
  // Lists the joints, and asks each model for its rows, by which the models count their turns.
  void Run(BodyStore& bodies);

  std::span<Joint* const> joints() const { return joints_; }
  std::span<JointRows> rows() { return {rows_.data(), joints_.size()}; }  // by index in `joints`
  std::span<const JointRows> rows() const { return {rows_.data(), joints_.size()}; }
  bool empty() const { return joints_.empty(); }

  // For assertions; linear in joints.
  bool Validate() const;

 private:
  void List(BodyStore& bodies);

  std::vector<Joint*> joints_;
  std::vector<JointRows> rows_;
};

}  // namespace tessera::physics
