// Visuals: which files of meshes the store has, how much room they take, and which of them nothing needs any more.
//
// A file's record is stored before its pieces and says that it is not whole; the last write says that it is. So
// whatever ends in between, what is there is whole, or known not to be and removed. Pieces themselves are written and
// removed by the caller, outside of the cluster's lock: they are large. The caller lets one write follow the other.
//
//   if (auto size = visuals.Begin(sha256, bytes); size.ok()) ...;   // pieces are written
//   visuals.Finish(sha256, now);
//   visuals.Sweep(now);            // Effects::visuals: files whose pieces are to be removed, then visuals.Remove
//
// Thread rule: as Cluster.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "control_plane/cluster/cluster_state.h"
#include "control_plane/now.h"
#include "tessera/v1/visuals.pb.h"

namespace tessera::control {

class Visuals {
 public:
  // `quota`: bytes; 0: none is taken. `keep`: how long one stays that nothing needs.
  Visuals(ClusterState& state, std::uint64_t quota, std::chrono::milliseconds keep)
      : state_(state), quota_(quota), keep_(keep) {}

  // DATA_LOSS names the key that cannot be read.
  absl::Status Load();

  bool keeps_none() const { return quota_ == 0; }
  // The sum of all that are there.
  std::uint64_t bytes() const;
  // Bytes of the file, which is whole; 0: there is no such file.
  std::uint64_t SizeOf(const std::string& sha256) const;
  // Those asked for that are there stay for the next minutes.
  absl::StatusOr<v1::FindMissingVisualsResponse> FindMissing(const v1::FindMissingVisualsRequest& request);
  // FAILED_PRECONDITION names a file that the scene refers to and that is missing.
  absl::Status CheckThere(const std::vector<std::string>& files) const;

  // Whether a file of that name and size would be taken. ALREADY_EXISTS: it is there, whole. INVALID_ARGUMENT names the
  // field; RESOURCE_EXHAUSTED, FAILED_PRECONDITION: as the service says.
  absl::Status CheckPut(const std::string& sha256, std::uint64_t size);
  // Stores that the file is on its way; what is left of an earlier try is the caller's to remove before.
  absl::Status Begin(const std::string& sha256, std::uint64_t size);
  // The pieces are stored.
  absl::Status Finish(const std::string& sha256);
  // They could not be; what there is of them goes with the next sweep.
  void Abandon(const std::string& sha256);
  // Bytes of a file that is not whole, and that nobody writes; 0: there is none.
  std::uint64_t LeftOver(const std::string& sha256) const;
  // Its pieces are removed.
  absl::Status Remove(const std::string& sha256);

  // Finds what no instance needs that has not ended.
  void Sweep(Now now);

 private:
  struct Entry {
    records::Visual record;
    Revision revision = kAbsent;
    Steady unneeded_since{0};  // 0: it is needed, or the next sweep says
    bool under_way = false;    // somebody writes its pieces
  };
  absl::Status Store(const std::string& sha256, Entry& entry, const records::Visual& next);

  ClusterState& state_;
  const std::uint64_t quota_;
  const std::chrono::nanoseconds keep_;
  std::map<std::string, Entry> files_;  // by hash
  Steady next_sweep_{0};
};

}  // namespace tessera::control
