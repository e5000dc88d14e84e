#include "control_plane/asked_leases.h"

#include <optional>
#include <utility>

namespace tessera::control {

void AskedLeases::Put(StreamId stream, v1::LeaseRequest request) { waiting_[stream].Put(std::move(request)); }

bool AskedLeases::Begin() {
  if (under_way_ || waiting_.empty()) return false;
  for (auto& [stream, requests] : waiting_) {
    while (std::optional<v1::LeaseRequest> request = requests.Take()) {
      proving_.push_back({.stream = stream, .request = *std::move(request)});
    }
  }
  waiting_.clear();
  under_way_ = true;
  return true;
}

std::vector<AskedLeases::Asked> AskedLeases::End(bool proved) {
  under_way_ = false;
  std::vector<Asked> asked = std::exchange(proving_, {});
  if (!proved) asked.clear();
  return asked;
}

}  // namespace tessera::control
