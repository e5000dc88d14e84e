// RegionKeys: what a worker proves itself with, as root of its host takes it: out of the memory of the process. Who has
// it can be that life of its region until somebody says otherwise.
//
//   const auto keys = TakeRegionKeys(region_status.report(), instance_key);
//   const auto knocks = LinkKnocks({*keys}, instance.region_status());   // links in its name
//
// Thread rule: free functions and plain values.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/world/ids.h"
#include "net/credential.h"
#include "net/signing_key.h"
#include "tessera/v1/instance.pb.h"
#include "tests/support/knocks.h"

namespace tessera::support {

struct RegionKeys {
  RegionId region{};
  Incarnation incarnation{};
  net::Credentials credentials{};
};

// Reads them from the process that the report names, which has been certified. PERMISSION_DENIED: its memory is not
// ours to read. NOT_FOUND: they are not there.
absl::StatusOr<RegionKeys> TakeRegionKeys(const v1::WorkerReport& report, const net::VerificationKey& instance_key);

// The public key of a world, as anybody is told who watches it. CommandError: nobody is let in.
net::VerificationKey InstanceKeyOf(const std::string& control, const std::string& instance);

using Regions = google::protobuf::RepeatedPtrField<v1::RegionStatus>;

// A link in the name of each of these to each of those regions that takes links of it: those of higher ids.
std::vector<Knock> LinkKnocks(const std::vector<RegionKeys>& keys, const Regions& regions);
// The same keys' own word for more than they are for: a certificate of the region with the next id, and a player's
// credential, shown to each of those regions.
std::vector<Knock> ForgedKnocks(const std::vector<RegionKeys>& keys, const Regions& regions);

// The control plane's answer to a host that fetches a scene of a world of its own, by its identity, which is the text
// of its agent's host.json.
absl::Status FetchSceneByIdentity(const std::string& control, const std::string& identity,
                                  const std::string& scene_hash);

}  // namespace tessera::support
