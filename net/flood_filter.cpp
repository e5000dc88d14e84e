#include "net/flood_filter.h"

#include <arpa/inet.h>
#include <linux/filter.h>
#include <sys/socket.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "net/datagram_kind.h"

namespace tessera::net {
namespace {

// The program sees the datagram from its UDP header on, and the IP header by offsets of its own.
constexpr std::uint32_t kSourcePort = 0, kFirstByte = 8;
constexpr auto kSourceHost = static_cast<std::uint32_t>(SKF_NET_OFF) + 12;
constexpr auto kRandom = static_cast<std::uint32_t>(SKF_AD_OFF + SKF_AD_RANDOM);
constexpr std::uint32_t kWhole = std::numeric_limits<std::uint32_t>::max();
// A share that changes by less is not worth a new program.
constexpr double kChange = 0.2;

sock_filter Step(int code, std::uint32_t value, std::uint8_t if_true = 0, std::uint8_t if_false = 0) {
  return {.code = static_cast<std::uint16_t>(code), .jt = if_true, .jf = if_false, .k = value};
}

std::uint32_t ByteOf(DatagramKind kind) { return static_cast<std::uint32_t>(kind); }

}  // namespace

FloodFilter::FloodFilter(int socket) : socket_(socket) {}

bool FloodFilter::Adapt(Kind& kind, std::uint64_t seen, double passed_s) {
  const double per_s = static_cast<double>(seen - kind.seen) / kind.passes / passed_s;
  kind.seen = seen;
  const double passes = per_s <= kind.most_per_s ? 1 : kind.most_per_s / per_s;
  const bool ends = passes == 1 && kind.passes < 1;
  if (!ends && std::abs(passes - kind.passes) <= kChange * kind.passes) return false;
  kind.passes = passes;
  return true;
}

void FloodFilter::Measure(TimePoint now, const UnprovenDatagrams& seen) {
  if (measured_ == TimePoint()) measured_ = now;
  if (now - measured_ < kUpdate) return;
  const double passed_s = std::chrono::duration<double>(now - measured_).count();
  measured_ = now;
  bool changed = Adapt(hellos_, seen.hellos, passed_s);
  changed |= Adapt(logins_, seen.logins, passed_s);
  changed |= Adapt(others_, seen.others, passed_s);
  for (; !shut_out_.empty() && now >= shut_out_.front().until; changed = true) shut_out_.pop_front();
  if (changed) Apply();
}

void FloodFilter::ShutOut(TimePoint now, const Address& address) {
  if (shut_out_.size() == kMaxShutOut) shut_out_.pop_front();
  shut_out_.push_back({address, now + kShutOut});
  Apply();
}

std::vector<sock_filter> FloodFilter::Program() const {
  constexpr int kLoadWord = BPF_LD | BPF_W | BPF_ABS, kLoadHalf = BPF_LD | BPF_H | BPF_ABS,
                kLoadByte = BPF_LD | BPF_B | BPF_ABS, kIfEqual = BPF_JMP | BPF_JEQ | BPF_K,
                kIfAtLeast = BPF_JMP | BPF_JGE | BPF_K, kReturn = BPF_RET | BPF_K;
  constexpr std::uint32_t kDrop = 0, kPass = kWhole;
  std::vector<sock_filter> program;
  for (const End& end : shut_out_) {
    program.push_back(Step(kLoadWord, kSourceHost));
    program.push_back(Step(kIfEqual, ntohl(end.address.host), 0, 3));
    program.push_back(Step(kLoadHalf, kSourcePort));
    program.push_back(Step(kIfEqual, end.address.port, 0, 1));
    program.push_back(Step(kReturn, kDrop));
  }
  const auto pass_a_share_of = [&](const Kind& kind) {
    program.push_back(Step(kLoadWord, kRandom));
    program.push_back(Step(kIfAtLeast, static_cast<std::uint32_t>(kind.passes * kWhole), 0, 1));
    program.push_back(Step(kReturn, kind.passes < 1 ? kDrop : kPass));
    program.push_back(Step(kReturn, kPass));
  };
  program.push_back(Step(kLoadByte, kFirstByte));
  program.push_back(Step(kIfEqual, ByteOf(DatagramKind::kSealed), 4, 0));
  program.push_back(Step(kIfEqual, ByteOf(DatagramKind::kDirect), 3, 0));
  program.push_back(Step(kIfEqual, ByteOf(DatagramKind::kHello), 3, 0));
  program.push_back(Step(kIfEqual, ByteOf(DatagramKind::kLogin), 6, 0));
  program.push_back(Step(BPF_JMP | BPF_JA, 9));
  program.push_back(Step(kReturn, kPass));
  pass_a_share_of(hellos_);
  pass_a_share_of(logins_);
  pass_a_share_of(others_);
  return program;
}

void FloodFilter::Apply() {
  const bool needed = !shut_out_.empty() || hellos_.passes < 1 || logins_.passes < 1 || others_.passes < 1;
  if (!needed) {
    int unused = 0;
    if (active_) (void)setsockopt(socket_, SOL_SOCKET, SO_DETACH_FILTER, &unused, sizeof unused);
    active_ = false;
    return;
  }
  std::vector<sock_filter> steps = Program();
  const sock_fprog program{.len = static_cast<unsigned short>(steps.size()), .filter = steps.data()};
  active_ = setsockopt(socket_, SOL_SOCKET, SO_ATTACH_FILTER, &program, sizeof program) == 0;
  if (active_) return;
  // Without a filter everything passes, and rates are measured so.
  hellos_.passes = logins_.passes = others_.passes = 1;
}

}  // namespace tessera::net
