// LeaseProof: the thread by which one of several control planes proves that it leads, for workers that ask for leases
// (asked_leases.h).
//
// A proof waits for the store. So it is made outside the cluster's lock and apart from its timer: while the store is
// slow nothing but these leases waits for it.
//
//   LeaseProof proof([&] { return election.Confirm(kLeaseProofPatience); }, [&](const auto& asked) { ... });
//   proof.Ask(stream, request);
//
// Thread rule: any thread asks; leases are given by the thread of this object, until its destructor returns.
#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

#include "control_plane/asked_leases.h"

namespace tessera::control {

class LeaseProof {
 public:
  // `proves_lead`: as LeaderRights has it. `give` is called for each request that came before a proof that succeeded.
  LeaseProof(std::function<bool()> proves_lead, std::function<void(const AskedLeases::Asked&)> give);
  // Waits for the proof that is under way.
  ~LeaseProof();
  LeaseProof(const LeaseProof&) = delete;
  LeaseProof& operator=(const LeaseProof&) = delete;

  void Ask(StreamId stream, v1::LeaseRequest request);

 private:
  void Run();
  void Say(bool leads);

  const std::function<bool()> proves_lead_;
  const std::function<void(const AskedLeases::Asked&)> give_;
  bool failed_ = false;  // the last proof did, and the log has it

  std::mutex mutex_;  // guards what follows
  std::condition_variable wake_;
  AskedLeases asked_;
  bool ending_ = false;
  std::thread thread_;
};

}  // namespace tessera::control
