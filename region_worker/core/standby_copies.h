// StandbyCopies: this region's copies of its primaries, the regions whose standby it is.
//
// Takes their logs, acknowledges each whole tick, asks for a whole state when there is a gap. Once a primary is
// declared dead, nothing more is taken from that life of it and nothing acknowledged: its copy stays as it is until
// Forget.
//
//   StandbyCopies copies(catalog);
//   copies.Set(order.primaries, links, actions);
//   copies.OnLog(from, piece, now, links, actions);
//   std::vector<const region::StandbyCopy*> dead = copies.Dead();
//
// Thread rule: one thread.
#pragma once

#include <map>
#include <optional>
#include <span>
#include <vector>

#include "core/region/standby_copy.h"
#include "region_worker/core/actions.h"
#include "region_worker/core/link_message.h"
#include "region_worker/core/link_table.h"
#include "region_worker/core/time.h"
#include "tessera/v1/worker_link.pb.h"

namespace tessera::worker {

class StandbyCopies {
 public:
  // One message of a log: a whole state of a region of 100 000 bodies, with room.
  static constexpr std::size_t kMaxLogBytes = 64u << 20;

  explicit StandbyCopies(const region::Catalog& catalog) : catalog_(catalog) {}

  // Until a primary's new standby has a whole copy, the old one's may be the only one. It stays for as long as it takes
  // to find a new one that takes its log: the control plane gives each 5 s, and stores another. Shorter, and a death
  // undoes what was committed; longer, and a copy costs memory that is of no more use.
  static constexpr Duration kRetiredFor = std::chrono::seconds(30);

  // Whole state. Copies of dead primaries stay, and those of regions that are primaries no more for a while.
  void Set(std::span<const RegionId> primaries, TimePoint now, const LinkTable& links, Actions& actions);
  // Forgets those whose time is over.
  void Expire(TimePoint now);
  void OnLog(RegionId from, const LinkMessage& message, TimePoint now, const LinkTable& links, Actions& actions);
  void OnLeaseAsk(RegionId from, std::uint64_t number, TimePoint now, const LinkTable& links, Actions& actions);

  // The promise: nothing is acknowledged to this life any more.
  void DeclareDead(RegionId region);
  std::vector<const region::StandbyCopy*> Dead() const;  // ascending; those that hold a whole tick
  // The fate of the dead is settled.
  void Forget(const LinkTable& links, Actions& actions);

  std::vector<const region::StandbyCopy*> Whole() const;  // ascending
  // When a primary was last sent an acknowledgement or a lease; nothing where there is no copy of it.
  std::optional<TimePoint> AcknowledgedAt(RegionId primary) const;
  // Adds the whole copies.
  void Report(v1::WorkerReport& report) const;
  std::uint64_t gaps() const { return gaps_; }  // messages that could not be used

 private:
  struct Primary {
    explicit Primary(region::StandbyCopy empty) : copy(std::move(empty)) {}
    region::StandbyCopy copy;
    region::Bytes partial;           // pieces of the message that is coming in
    LinkTable::LinkNumber link = 0;  // over which they come
    bool dead = false, wanted = true;
    bool stale = false;       // it has missed something, and stays until there is a new whole state in its place
    std::uint64_t signs = 0;  // that it lives
    TimePoint acknowledged_at{};
    TimePoint retired_at{};  // where it is not wanted
    TimePoint may_ask_at{};
  };
  void Add(RegionId region, const LinkTable& links, Actions& actions);
  void Take(RegionId from, Primary& primary, TimePoint now, const LinkTable& links, Actions& actions);

  const region::Catalog& catalog_;
  std::map<RegionId, Primary> primaries_;
  std::uint64_t gaps_ = 0;
};

}  // namespace tessera::worker
