#include "net/flood_filter.h"

#include <algorithm>
#include <cmath>

namespace tessera::net {
namespace {

// A share that changes by less is not worth a new program.
constexpr double kChange = 0.2;
// Share that passes of an end until its rate is known.
constexpr double kFirstShare = 1.0 / 64;

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

void FloodFilter::Measure(TimePoint now, const UnprovenDatagrams& seen,
                          const std::function<std::optional<std::uint64_t>(SessionNumber)>& received_of) {
  if (measured_ == TimePoint()) measured_ = now;
  if (now - measured_ < kUpdate) return;
  const double passed_s = std::chrono::duration<double>(now - measured_).count();
  measured_ = now;
  bool changed = Adapt(hellos_, seen.hellos, passed_s);
  changed |= Adapt(strangers_, seen.strangers, passed_s);
  changed |= Adapt(logins_, seen.logins, passed_s);
  changed |= Adapt(others_, seen.others, passed_s);
  for (Limited& limited : limited_) {
    const std::optional<std::uint64_t> received = received_of(limited.session);
    const double since_s = std::chrono::duration<double>(now - limited.since).count();
    if (received && since_s > passed_s / 2) changed |= Adapt(limited.kind, *received, std::min(passed_s, since_s));
    if (!received) limited.kind.passes = 1;
  }
  changed |= std::erase_if(limited_, [](const Limited& limited) { return limited.kind.passes == 1; }) > 0;
  for (; !shut_out_.empty() && now >= shut_out_.front().until; changed = true) shut_out_.pop_front();
  if (changed) Apply();
}

void FloodFilter::Open(const Knock& knock) {
  knock_ = knock;
  if (active_) Apply();
}

void FloodFilter::Limit(TimePoint now, SessionNumber session, const Address& end, double most_per_s,
                        std::uint64_t received) {
  const bool known = std::ranges::any_of(limited_, [&](const Limited& other) { return other.session == session; });
  if (known || most_per_s <= 0) return;
  if (limited_.size() == kMaxShutOut) limited_.pop_front();
  limited_.push_back({session, end, {.most_per_s = most_per_s, .passes = kFirstShare, .seen = received}, now});
  Apply();
}

void FloodFilter::ShutOut(TimePoint now, const Address& address) {
  if (shut_out_.size() == kMaxShutOut) shut_out_.pop_front();
  shut_out_.push_back({address, now + kShutOut});
  Apply();
}

void FloodFilter::Apply() {
  const bool needed = !shut_out_.empty() || !limited_.empty() || hellos_.passes < 1 || strangers_.passes < 1 ||
                      logins_.passes < 1 || others_.passes < 1;
  if (!needed) {
    if (active_) ClearDropRules(socket_);
    active_ = false;
    return;
  }
  DropRules rules{.shut_out = {},
                  .limited = {},
                  .knock = knock_,
                  .hellos = hellos_.passes,
                  .strangers = strangers_.passes,
                  .logins = logins_.passes,
                  .others = others_.passes};
  rules.shut_out.reserve(shut_out_.size());
  for (const End& end : shut_out_) rules.shut_out.push_back(end.address);
  for (const Limited& limited : limited_) rules.limited.push_back({limited.end, limited.kind.passes});
  active_ = SetDropRules(socket_, rules);
  if (active_) return;
  // Without a filter everything passes, and rates are measured so.
  hellos_.passes = strangers_.passes = logins_.passes = others_.passes = 1;
  limited_.clear();
}

}  // namespace tessera::net
