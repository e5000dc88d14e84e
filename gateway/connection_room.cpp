#include "gateway/connection_room.h"

namespace tessera::gateway {

void ConnectionRoom::Opened(const void* connection, const std::string& address) {
  const auto [at, is_new] = connections_.try_emplace(connection, Connection{address, Verdict::kServed});
  if (!is_new) return;
  const auto of_address = served_of_address_.find(address);
  if (served_ >= most_) {
    at->second.verdict = Verdict::kFull;
  } else if (of_address != served_of_address_.end() && of_address->second >= most_of_address_) {
    at->second.verdict = Verdict::kAddressFull;
  } else {
    ++served_;
    ++served_of_address_[address];
  }
}

void ConnectionRoom::Closed(const void* connection) {
  const auto found = connections_.find(connection);
  if (found == connections_.end()) return;
  if (found->second.verdict == Verdict::kServed) {
    --served_;
    const auto of_address = served_of_address_.find(found->second.address);
    if (--of_address->second == 0) served_of_address_.erase(of_address);
  }
  connections_.erase(found);
}

ConnectionRoom::Verdict ConnectionRoom::Of(const void* connection) const {
  const auto found = connections_.find(connection);
  return found == connections_.end() ? Verdict::kFull : found->second.verdict;
}

}  // namespace tessera::gateway
