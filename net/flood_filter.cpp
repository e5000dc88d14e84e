#include "net/flood_filter.h"

#include <cmath>

namespace tessera::net {
namespace {

// A share that changes by less is not worth a new program.
constexpr double kChange = 0.2;

}  // namespace

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

void FloodFilter::Apply() {
  const bool needed = !shut_out_.empty() || hellos_.passes < 1 || logins_.passes < 1 || others_.passes < 1;
  if (!needed) {
    if (active_) ClearDropRules(socket_);
    active_ = false;
    return;
  }
  DropRules rules{.shut_out = {}, .hellos = hellos_.passes, .logins = logins_.passes, .others = others_.passes};
  rules.shut_out.reserve(shut_out_.size());
  for (const End& end : shut_out_) rules.shut_out.push_back(end.address);
  active_ = SetDropRules(socket_, rules);
  if (active_) return;
  // Without a filter everything passes, and rates are measured so.
  hellos_.passes = logins_.passes = others_.passes = 1;
}

}  // namespace tessera::net
