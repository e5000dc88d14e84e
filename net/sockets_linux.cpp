#include <arpa/inet.h>
#include <linux/filter.h>
#include <linux/sock_diag.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cassert>
#include <cerrno>
#include <cstring>
#include <limits>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "net/datagram_kind.h"
#include "net/sockets.h"

namespace tessera::net {
namespace {

// The program sees the datagram from its UDP header on, and the IP header by offsets of its own.
constexpr std::uint32_t kSourcePort = 0, kFirstByte = 8;
constexpr auto kSourceHost = static_cast<std::uint32_t>(SKF_NET_OFF) + 12;
constexpr auto kRandom = static_cast<std::uint32_t>(SKF_AD_OFF + SKF_AD_RANDOM);
constexpr std::uint32_t kWhole = std::numeric_limits<std::uint32_t>::max();

// Closes on scope exit.
class ProbeSocket {
 public:
  ProbeSocket() : fd_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {}
  ~ProbeSocket() {
    if (fd_ >= 0) close(fd_);
  }
  ProbeSocket(const ProbeSocket&) = delete;
  ProbeSocket& operator=(const ProbeSocket&) = delete;
  int fd() const { return fd_; }

 private:
  int fd_;
};

sockaddr_in ToSockaddr(const Address& address) {
  sockaddr_in result{};
  result.sin_family = AF_INET;
  result.sin_port = htons(address.port);
  result.sin_addr.s_addr = address.host;
  return result;
}

SocketFault FaultOf(int error) {
  SocketFault fault{.text = std::strerror(error)};
  if (error == EADDRINUSE) fault.kind = SocketFault::Kind::kInUse;
  if (error == EADDRNOTAVAIL) fault.kind = SocketFault::Kind::kNoSuchAddress;
  if (error == EACCES) fault.kind = SocketFault::Kind::kNoPrivilege;
  return fault;
}

void RaiseBuffer(int socket, int bytes, int forced_option, int option) {
  if (setsockopt(socket, SOL_SOCKET, forced_option, &bytes, sizeof bytes) == 0) return;
  setsockopt(socket, SOL_SOCKET, option, &bytes, sizeof bytes);
}

sock_filter Step(int code, std::uint32_t value, std::uint8_t if_true = 0, std::uint8_t if_false = 0) {
  return {.code = static_cast<std::uint16_t>(code), .jt = if_true, .jf = if_false, .k = value};
}

std::uint32_t ByteOf(DatagramKind kind) { return static_cast<std::uint32_t>(kind); }

// As the kernel loads it: the first byte is the highest.
std::uint32_t LoadedWord(const Knock& knock) {
  return std::uint32_t{knock[0]} << 24 | std::uint32_t{knock[1]} << 16 | std::uint32_t{knock[2]} << 8 | knock[3];
}

std::vector<sock_filter> ProgramOf(const DropRules& rules) {
  constexpr int kLoadWord = BPF_LD | BPF_W | BPF_ABS, kLoadHalf = BPF_LD | BPF_H | BPF_ABS,
                kLoadByte = BPF_LD | BPF_B | BPF_ABS, kIfEqual = BPF_JMP | BPF_JEQ | BPF_K,
                kIfAtLeast = BPF_JMP | BPF_JGE | BPF_K, kReturn = BPF_RET | BPF_K;
  constexpr std::uint32_t kDrop = 0, kPass = kWhole;
  std::vector<sock_filter> program;
  for (const Address& end : rules.shut_out) {
    program.push_back(Step(kLoadWord, kSourceHost));
    program.push_back(Step(kIfEqual, ntohl(end.host), 0, 3));
    program.push_back(Step(kLoadHalf, kSourcePort));
    program.push_back(Step(kIfEqual, end.port, 0, 1));
    program.push_back(Step(kReturn, kDrop));
  }
  for (const DropRules::Limited& limited : rules.limited) {
    program.push_back(Step(kLoadWord, kSourceHost));
    program.push_back(Step(kIfEqual, ntohl(limited.end.host), 0, 5));
    program.push_back(Step(kLoadHalf, kSourcePort));
    program.push_back(Step(kIfEqual, limited.end.port, 0, 3));
    program.push_back(Step(kLoadWord, kRandom));
    program.push_back(Step(kIfAtLeast, static_cast<std::uint32_t>(limited.passes * kWhole), 0, 1));
    program.push_back(Step(kReturn, kDrop));
  }
  const auto pass_a_share = [&](double share) {
    program.push_back(Step(kLoadWord, kRandom));
    program.push_back(Step(kIfAtLeast, static_cast<std::uint32_t>(share * kWhole), 0, 1));
    program.push_back(Step(kReturn, share < 1 ? kDrop : kPass));
    program.push_back(Step(kReturn, kPass));
  };
  program.push_back(Step(kLoadByte, kFirstByte));
  program.push_back(Step(kIfEqual, ByteOf(DatagramKind::kSealed), 4, 0));
  program.push_back(Step(kIfEqual, ByteOf(DatagramKind::kDirect), 3, 0));
  program.push_back(Step(kIfEqual, ByteOf(DatagramKind::kHello), 3, 0));
  program.push_back(Step(kIfEqual, ByteOf(DatagramKind::kLogin), 12, 0));
  program.push_back(Step(BPF_JMP | BPF_JA, 15));
  program.push_back(Step(kReturn, kPass));
  program.push_back(Step(kLoadWord, kFirstByte + kKnockAt));  // a shorter datagram does not pass
  program.push_back(Step(kIfEqual, LoadedWord(rules.knock.value_or(Knock{})), rules.knock ? 0 : 4, 4));
  pass_a_share(rules.hellos);
  pass_a_share(rules.strangers);
  pass_a_share(rules.logins);
  pass_a_share(rules.others);
  return program;
}

}  // namespace

std::optional<std::uint32_t> HostFrom(const std::string& text) {
  in_addr host{};
  return inet_pton(AF_INET, text.c_str(), &host) == 1 ? std::optional(host.s_addr) : std::nullopt;
}

absl::StatusOr<std::uint32_t> LookUpHost(const std::string& host) {
  addrinfo hints{};
  hints.ai_family = AF_INET;
  hints.ai_socktype = SOCK_DGRAM;
  addrinfo* found = nullptr;
  if (const int error = getaddrinfo(host.c_str(), nullptr, &hints, &found); error != 0) {
    return absl::InvalidArgumentError(absl::StrCat("host ", host, ": ", gai_strerror(error)));
  }
  const std::uint32_t result = reinterpret_cast<const sockaddr_in*>(found->ai_addr)->sin_addr.s_addr;
  freeaddrinfo(found);
  return result;
}

std::optional<SocketFault> TryBind(const Address& address) {
  const ProbeSocket probe;
  const sockaddr_in to = ToSockaddr(address);
  if (probe.fd() >= 0 && bind(probe.fd(), reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0) return std::nullopt;
  return FaultOf(errno);
}

std::optional<SocketFault> TryRoute(const Address& to_address) {
  const ProbeSocket probe;
  const sockaddr_in to = ToSockaddr(to_address);
  if (probe.fd() >= 0 && connect(probe.fd(), reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0) {
    return std::nullopt;
  }
  return FaultOf(errno);
}

void ForgetFault() { errno = 0; }
SocketFault LastFault() { return FaultOf(errno != 0 ? errno : ENOMEM); }

void RaiseBuffers(SystemSocket socket, int bytes) {
  RaiseBuffer(socket, bytes, SO_RCVBUFFORCE, SO_RCVBUF);
  RaiseBuffer(socket, bytes, SO_SNDBUFFORCE, SO_SNDBUF);
}

void SendNow(SystemSocket socket, const Address& to, std::span<const std::uint8_t> bytes) {
  const sockaddr_in address = ToSockaddr(to);
  (void)sendto(socket, bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL,
               reinterpret_cast<const sockaddr*>(&address), sizeof address);
}

void SendNow(SystemSocket socket, std::span<OutgoingDatagram> datagrams) {
  assert(datagrams.size() <= kMaxSentAtOnce);
  std::array<sockaddr_in, kMaxSentAtOnce> to;
  std::array<iovec, kMaxSentAtOnce> parts;
  std::array<mmsghdr, kMaxSentAtOnce> headers;
  for (std::size_t i = 0; i < datagrams.size(); ++i) {
    to[i] = ToSockaddr(datagrams[i].to);
    parts[i] = {.iov_base = datagrams[i].bytes.data(), .iov_len = datagrams[i].size};
    headers[i] = {};
    headers[i].msg_hdr.msg_name = &to[i];
    headers[i].msg_hdr.msg_namelen = sizeof to[i];
    headers[i].msg_hdr.msg_iov = &parts[i];
    headers[i].msg_hdr.msg_iovlen = 1;
  }
  for (std::size_t done = 0; done < datagrams.size();) {
    const int sent =
        sendmmsg(socket, &headers[done], static_cast<unsigned>(datagrams.size() - done), MSG_DONTWAIT | MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    // Where none was sent, the first cannot be; those after it may have other routes.
    done += static_cast<std::size_t>(std::max(sent, 1));
  }
}

std::optional<std::uint32_t> KernelDrops(SystemSocket socket) {
  std::array<std::uint32_t, SK_MEMINFO_VARS> memory{};
  socklen_t bytes = sizeof memory;
  if (getsockopt(socket, SOL_SOCKET, SO_MEMINFO, memory.data(), &bytes) != 0) return std::nullopt;
  return memory[SK_MEMINFO_DROPS];
}

bool SetDropRules(SystemSocket socket, const DropRules& rules) {
  std::vector<sock_filter> steps = ProgramOf(rules);
  const sock_fprog program{.len = static_cast<unsigned short>(steps.size()), .filter = steps.data()};
  return setsockopt(socket, SOL_SOCKET, SO_ATTACH_FILTER, &program, sizeof program) == 0;
}

void ClearDropRules(SystemSocket socket) {
  int unused = 0;
  (void)setsockopt(socket, SOL_SOCKET, SO_DETACH_FILTER, &unused, sizeof unused);
}

}  // namespace tessera::net
