#include "net/outbox.h"

#include <cassert>

namespace tessera::net {

void Outbox::Add(const Address& to, std::size_t bytes) {
  assert(count_ < datagrams_.size() && bytes <= kMaxUdpBytes);
  datagrams_[count_].to = to;
  datagrams_[count_].size = bytes;
  ++count_;
}

void Outbox::Send() {
  SendNow(socket_, std::span(datagrams_).first(count_));
  count_ = 0;
}

}  // namespace tessera::net
