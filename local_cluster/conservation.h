// Conservation: whether an instance still has every body, once each, by the censuses of its regions.
//
// All regions take a census at the same ticks (core/region/census.h). A tick counts once every region of the map has
// reported it; then the sums must equal the number of bodies and the checksum of their ids. When the map changes, ticks
// count again from the first that all of its regions step by it. A body that its owner reports to have taken out of the
// world, because its state was no longer finite or within limits, is not lost: it is counted as that. Bodies that the
// game made are not counted, and those that it removed are not expected any more.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <span>

#include "core/world/ids.h"
#include "tessera/v1/instance.pb.h"

namespace tessera::local {

struct ConservationResult {
  std::uint64_t tick = 0;  // when the newest complete census was taken
  std::uint64_t expected = 0;
  std::uint64_t found = 0;
  // At the newest census: on its way across a closed border a body is kept by who sent it and owned by nobody, so what
  // is missed for a while and back is not lost. If both happen in equal number, each counts at least 1.
  std::uint64_t lost = 0;
  std::uint64_t duplicated = 0;  // the worst: no body may have two owners, ever
  std::uint64_t taken_out = 0;   // and reported; not expected any more
  std::uint64_t censuses = 0;    // complete ones that were compared
};

class Conservation {
 public:
  // `bodies`: the dynamic ones of the scene.
  explicit Conservation(std::span<const BodyId> bodies);

  // From now on this body is expected as well. Censuses older than `from_tick` are not compared.
  void Expect(BodyId body, std::uint64_t from_tick);
  // Takes in what the regions report; call it on every change of the instance.
  void Observe(const v1::Instance& instance);

  // Covers all complete censuses until now; empty before the first one.
  std::optional<ConservationResult> result() const { return result_; }

 private:
  struct Sum {
    std::uint64_t owned = 0, checksum = 0;
    std::set<std::uint32_t> regions;  // that have reported
  };
  void Compare(std::uint64_t tick, const Sum& sum);
  // False while a new map is not in force everywhere.
  bool FollowMap(const v1::Instance& instance);
  void NoteTakenOut(const v1::Instance& instance);
  bool NoteRemoved(const v1::WorkerReport& report);
  void CountFromNow(const v1::Instance& instance);

  std::set<BodyId> bodies_, taken_out_;  // expected; not any more
  std::uint64_t checksum_ = 0, from_tick_ = 0;
  std::map<std::uint64_t, Sum> open_;  // by tick
  std::uint64_t last_compared_ = 0;
  std::uint64_t map_version_ = 0;
  bool in_force_ = true;
  std::optional<ConservationResult> result_;
};

}  // namespace tessera::local
