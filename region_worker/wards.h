// Wards: this region's copies of the regions whose heir it is.
//
// Takes their logs, acknowledges each whole tick, asks for a whole state when there is a gap. Once a ward is declared
// dead, nothing more is taken from that life of it and nothing acknowledged: its copy stays as it is until Forget.
//
//   Wards wards(links, region.catalog(), metrics);
//   wards.Set(order.wards);
//   wards.OnLog(from, piece, last, now);
//   std::vector<const region::Standby*> copies = wards.Dead();
//
// Thread rule: one thread.
#pragma once

#include <map>
#include <memory>
#include <span>
#include <vector>

#include "core/region/standby.h"
#include "region_worker/link_message.h"
#include "region_worker/link_port.h"
#include "region_worker/tick_pacer.h"
#include "region_worker/worker_metrics.h"
#include "tessera/v1/worker_link.pb.h"

namespace tessera::worker {

class Wards {
 public:
  // Of one message of a log: a whole state of a region of 100 000 bodies, with room.
  static constexpr std::size_t kMaxLogBytes = 64u << 20;

  struct Ward {
    explicit Ward(region::Standby empty) : copy(std::move(empty)) {}
    region::Standby copy;
    region::Bytes partial;   // pieces of the message that is coming in
    net::PeerHandle link{};  // over which they come
    bool dead = false, wanted = true;
    std::uint64_t signs = 0;  // of life
    TimePoint acknowledged_at{};
    TimePoint may_ask_at{};
  };

  Wards(LinkPort& links, const region::Catalog& catalog, WorkerMetrics& metrics)
      : links_(links), catalog_(catalog), metrics_(metrics) {}

  // Whole state. Copies of dead ones stay.
  void Set(std::span<const RegionId> wards);
  void OnLog(RegionId from, const LinkMessage& message, TimePoint now);

  void OnLeaseAsk(RegionId from, std::uint64_t number, TimePoint now);

  // The promise: nothing is acknowledged to this life any more.
  void DeclareDead(RegionId region);
  std::vector<const region::Standby*> Dead() const;  // ascending; those that hold a whole tick
  // What became of the dead is settled.
  void Forget();
  // Adds what it holds whole copies of.
  void Report(v1::WorkerReport& report) const;

  const std::map<RegionId, Ward>& all() const { return wards_; }

 private:
  void Add(RegionId region);
  void Take(RegionId from, Ward& ward, TimePoint now);

  LinkPort& links_;
  const region::Catalog& catalog_;
  WorkerMetrics& metrics_;
  std::map<RegionId, Ward> wards_;
};

}  // namespace tessera::worker
