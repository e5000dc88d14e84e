// Snapshots: how a client comes to see what a region owns. This header includes all that users of snapshots need.
//
// Once a tick a region quantises the bodies that changed into a SnapshotHistory that all its clients share. For each
// client a SnapshotSender writes datagrams. Each datagram decodes alone, holds some bodies, and names for each body the
// acknowledged ticks that predict it; a body without any is sent as a full record. The client's SnapshotReceiver
// rebuilds the states and makes the acknowledgements. So a lost datagram costs only itself.
//
//   history.Push(tick, changed, departures);                             // once a tick that is sent
//   for (auto& bytes : sender.Write(history, view, ...).datagrams) send;  // per client
//   ...
//   receiver.Read(bytes);  send(receiver.WriteAck());                    // client
//   ...
//   sender.Acknowledge(ack_bytes);
//
// A body that rests and is acknowledged costs neither bytes nor time; where all bodies do, a datagram still leaves now
// and then. A client is sent only what it is interested in (interest.h), within its bytes a second: important bodies go
// first, a body that has to wait gains priority with each snapshot, and a client that joins is sent the nearest bodies
// first. A body that is there no more is sent as a departure until that is acknowledged, with the reason: removed,
// handed over and to whom, or out of interest.
//
// Nothing in a datagram is trusted: every count and range is checked, and an error leaves the receiver as it was.
// Thread rule: one thread at a time for a history with its senders, and for each receiver.
#pragma once

#include "core/replication/snapshot_history.h"
#include "core/replication/snapshot_receiver.h"
#include "core/replication/snapshot_record.h"
#include "core/replication/snapshot_sender.h"
#include "core/replication/snapshot_settings.h"
