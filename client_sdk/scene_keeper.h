// SceneKeeper: writes a packed scene into the folder that keeps it for the next time, a part with each call.
//
//   SceneKeeper keeper(file, std::move(bytes));
//   while (!keeper.Go(budget)) ...                      // once a poll
//
// The file has another name until it is whole, so a file of the right name is a whole one; without an end the part is
// removed. It begins with the sum of the rest (kept_sum.h), or with the one that is given. Whatever goes wrong costs no
// more than that the scene is fetched again. Thread rule: one thread at a time; Go touches files.
#pragma once

#include <cstdint>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "client_sdk/kept_sum.h"
#include "client_sdk/work_budget.h"
#include "core/replication/scene_transfer.h"

namespace tessera::client {

class SceneKeeper {
 public:
  // `file`: its folder is made where there is none.
  SceneKeeper(std::string file, std::vector<std::uint8_t> bytes, std::optional<replication::Digest> sum = {});
  ~SceneKeeper();
  SceneKeeper(const SceneKeeper&) = delete;
  SceneKeeper& operator=(const SceneKeeper&) = delete;

  // True once it is over, well or not.
  bool Go(WorkBudget& budget);

 private:
  void Begin(const replication::Digest& sum);
  void GiveUp();

  std::string file_, part_;
  std::vector<std::uint8_t> bytes_;
  std::size_t written_ = 0;
  std::optional<replication::Digest> given_;
  KeptSum sum_;
  std::ofstream out_;
};

}  // namespace tessera::client
