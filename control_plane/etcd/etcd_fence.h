// EtcdFence: the proof by which etcd tells the leader's writes from those of a leader that was deposed.
//
// It is the revision at which the key of the election was created. Whoever is elected later has a higher one, and every
// write of a leader is a transaction that compares it: so a write that a deposed leader sent fails, whenever it
// arrives. Thread rule: a value.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include "control_plane/etcd/etcd.pb.h"

namespace tessera::control {

struct EtcdFence {
  std::string key;
  std::int64_t token = 0;

  void AddTo(etcdserverpb::TxnRequest& request) const {
    etcdserverpb::Compare& compare = *request.add_compare();
    compare.set_target(etcdserverpb::Compare::CREATE);
    compare.set_key(key);
    compare.set_create_revision(token);
  }
};

// How long one write may take at etcd, and how long it is tried to learn what became of one that was not answered. etcd
// elects a new leader of its own in 1 to 2 s; the cluster's lock is held for so long.
inline constexpr std::chrono::milliseconds kEtcdWritePatience{2000}, kEtcdSettlePatience{4000};
inline constexpr std::chrono::milliseconds kEtcdReadPatience{5000};

}  // namespace tessera::control
