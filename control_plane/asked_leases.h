// AskedLeases: requests for leases that wait until this one of several control planes has proved that it leads.
//
// A lease is given by a leader alone, and a leader may have been deposed without knowing it. So each request waits for
// a proof that was begun after it came: a read of the leader's key that no other leader can have preceded. Then
//
//   asked <= came <= proof begun < next leader elected <= its state loaded,
//
// and the worker, which counts its lease from when it asked, stands still before the next leader, which counts it from
// when it loaded its state, puts another in its place. No clock of the giver is in it, however long the proof takes.
//
//   asked.Put(stream, request);
//   if (asked.Begin()) read the leader's key          // it is sent now
//   for (auto& [stream, request] : asked.End(leads)) give a lease
//
// Thread rule: none of its own.
#pragma once

#include <map>
#include <vector>

#include "control_plane/cluster/effects.h"
#include "control_plane/pending_leases.h"

namespace tessera::control {

class AskedLeases {
 public:
  struct Asked {
    StreamId stream = 0;
    v1::LeaseRequest request;
  };

  // The newest of each worker is kept.
  void Put(StreamId stream, v1::LeaseRequest request);
  // True: a proof is to be begun now, and is for all that have been put so far. False: there are none, or a proof is
  // under way already.
  bool Begin();
  // The proof that is under way is over. Those that it was for, if it `proved` anything; else they are forgotten, since
  // workers ask again.
  std::vector<Asked> End(bool proved);

 private:
  std::map<StreamId, PendingLeaseRequests> waiting_;
  std::vector<Asked> proving_;
  bool under_way_ = false;
};

}  // namespace tessera::control
