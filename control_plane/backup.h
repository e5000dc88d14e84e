// Backup: all that a store holds at one moment, as one file, and a store made of it. Files of meshes are left out: they
// are large, and whoever makes a world has them.
//
//   WriteBackup(store, [&](std::string_view piece) { return Send(piece); });
//   RestoreBackup(bytes, empty_store);       // everything or nothing
//
// The file: "tessera backup 1\n"; for each key, in their order, the length of the key and of the value, 4 bytes each,
// the lowest first, then both; 8 bytes 0xff; the SHA-256 of all before it, 64 hexadecimal digits. The key of the
// cluster's authority is in it as the store has it, encrypted under seal.key, which is not.
//
// A backup may be old. So that nothing is given twice that was given after it was made, a store that is made of one
// counts on from far above (kRestoreJump), and is marked as recovering: its control plane takes up what runs from the
// hosts before it orders anything (cluster/recovery.h). Where that shows that a store was made of this backup, or of an
// older one, before, all numbers are raised once more.
//
// Thread rule: free functions on values.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "control_plane/control_records.pb.h"
#include "control_plane/secrets.h"
#include "control_plane/store.h"

namespace tessera::control {

// By so much lives, incarnations, maps, players and ids are higher after a restore than the backup has them: more than
// anybody makes between two backups, and few enough that 32 bits take hundreds of restores.
inline constexpr std::uint64_t kRestoreJump = 1'000'000;
// Ids of hosts and instances are higher by a drawn number below this besides: of two restores of one backup, the second
// does not know what the first has given out, and agents' revocations name hosts of the first.
inline constexpr std::uint64_t kRestoreSpread = 10'000'000;
// Restores in the life of a cluster: a host that shows the orders of a later life than so many could have had is not
// believed, or one that was taken over would use up the lives.
inline constexpr std::uint64_t kMostRestores = 100;
// A file beyond it is not read: the store of a large cluster has some hundred megabytes.
inline constexpr std::size_t kMaxBackupBytes = std::size_t{4} << 30;

// `sink` takes the next bytes; an error of it ends the backup. UNAVAILABLE: the store cannot be read.
absl::Status WriteBackup(const Store& store, const std::function<absl::Status(std::string_view)>& sink);

struct RestoreReport {
  std::size_t hosts = 0, instances = 0;
};
// DATA_LOSS: the file is damaged or cut short, or has a record that cannot be read, which is named;
// INVALID_ARGUMENT: it is no backup, or of a newer version; FAILED_PRECONDITION: the store is not empty. Nothing was
// written then.
absl::StatusOr<RestoreReport> RestoreBackup(std::string_view file, Store& store,
                                            const RandomBytes& random = SystemRandomBytes);

// The record with its numbers above all that may have been given since.
void Raise(records::Counters& counters, const RandomBytes& random);
void Raise(records::Instance& record);
void Raise(records::Revocations& record);

}  // namespace tessera::control
