#include "net/outbox.h"

#include <arpa/inet.h>

#include <algorithm>
#include <cassert>
#include <cerrno>

namespace tessera::net {

Outbox::Outbox(int socket) : socket_(socket) {
  for (unsigned i = 0; i < kDatagrams; ++i) {
    Datagram& datagram = datagrams_[i];
    datagram.to.sin_family = AF_INET;
    datagram.part.iov_base = datagram.bytes.data();
    headers_[i].msg_hdr = {.msg_name = &datagram.to,
                           .msg_namelen = sizeof datagram.to,
                           .msg_iov = &datagram.part,
                           .msg_iovlen = 1,
                           .msg_control = nullptr,
                           .msg_controllen = 0,
                           .msg_flags = 0};
  }
}

void Outbox::Add(const Address& to, std::size_t bytes) {
  assert(count_ < kDatagrams && bytes <= kMaxUdpBytes);
  Datagram& datagram = datagrams_[count_++];
  datagram.to.sin_port = htons(to.port);
  datagram.to.sin_addr.s_addr = to.host;
  datagram.part.iov_len = bytes;
}

void Outbox::Send() {
  for (unsigned done = 0; done < count_;) {
    const int sent = sendmmsg(socket_, &headers_[done], count_ - done, MSG_DONTWAIT | MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    // Where none was sent, the first cannot be; those after it may have other routes.
    done += static_cast<unsigned>(std::max(sent, 1));
  }
  count_ = 0;
}

}  // namespace tessera::net
