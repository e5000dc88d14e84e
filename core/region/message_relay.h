// MessageRelay: carries the messages of game code from region to region, so that each is applied exactly once
// (core/game/mail.h has the numbers that see to it).
//
// A message leaves when the standby has the tick that made it, and is sent again until its target's region acknowledges
// it; that acknowledgement leaves when the target's standby has the message. So both ends' regions may die, and copies
// may come in any number and order.
//
// Where a target is, is known from bodies that are seen across a border, from bodies that were handed over, and from
// what came from the target before; a body that others write to is announced to all when it changes hands. A packet for
// a known place goes there by the fewest borders, and on from there where the body has gone on. Otherwise it goes to
// all regions, each of which passes it on once. No region keeps anything for others; a packet that is lost is sent
// again.
//
// The properties of the world go to all regions, which see them some ticks later: always so many, whatever the network
// does.
//
// Thread rule: one thread at a time.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "core/region/bodies.h"
#include "core/region/borders.h"
#include "core/region/catalog.h"
#include "core/region/message_packet.h"
#include "core/region/neighborhood.h"
#include "core/region/outgoing.h"
#include "core/region/ownership.h"
#include "core/region/question_desk.h"
#include "core/region/record_table.h"
#include "core/region/routes.h"
#include "core/region/tombstones.h"
#include "core/region/world_properties.h"

namespace tessera::region {

struct RelayStatistics {
  std::uint64_t sent = 0;       // messages that left for another region, each once
  std::uint64_t repeated = 0;   // sent again, because no acknowledgement had come
  std::uint64_t copies = 0;     // came, and were here already
  std::uint64_t refused = 0;    // dropped because their target is gone, or was not found for ten minutes
  std::uint64_t forwarded = 0;  // packets for other regions
};

class MessageRelay {
 public:
  // All must outlive it.
  MessageRelay(const Catalog& catalog, const Neighborhood& neighborhood, const Borders& borders, const Bodies& bodies,
               RecordTable& records, Ownership& ownership, Tombstones& tombstones, OutgoingMessages& outgoing,
               QuestionDesk& questions)
      : catalog_(catalog),
        neighborhood_(neighborhood),
        borders_(borders),
        bodies_(bodies),
        records_(records),
        ownership_(ownership),
        tombstones_(tombstones),
        outgoing_(outgoing),
        questions_(questions) {}

  // --- The beginning of the step to `now`.
  // A record went to a neighbour, and came from one.
  void HandedOver(BodyId id, RegionId to, Tick now);
  void TakenIn(BodyId id, RegionId from, Tick now);
  // Packets of a neighbour, after what it granted.
  void Receive(RegionId from, std::span<const MessagePacket> packets, Tick now);

  // --- After the game has run.
  // Lets go whatever the standby has; without a standby all.
  void Send(Tick now, std::optional<Tick> standby_has);
  // Whether anything waits for the standby, so that the next frames will not be silent.
  bool waits() const { return waits_; }

  // A failover has made void what was under way.
  void Restart();
  // The properties of the world in the state that this region begins with.
  void BeginWith(const std::vector<std::uint8_t>& instance_properties);
  // Those that clients may be told: what no death of one region takes back, here as far as `committed`.
  std::optional<WorldProperties> WorldForClients(Tick now, Tick committed) const;
  // Properties of the world as they are to be seen in this tick where another region owns them.
  std::span<const std::uint8_t> InstanceProperties(Tick now) const;
  const RelayStatistics& statistics() const { return statistics_; }

 private:
  using Packet = MessagePacket;
  // A copy of a packet that goes to all regions.
  using FloodKey = std::tuple<PacketKind, BodyId, BodyId, std::uint64_t, RegionId, Tick>;
  struct Attempt {
    Tick next;
    std::uint32_t times = 0;
  };
  struct Place {
    RegionId region;
    Tick since;  // when the record came or went
  };
  struct InstanceVersion {
    Epoch epoch;
    Tick made, seen;
    std::vector<std::uint8_t> bytes;
    bool own = false;  // by this region
  };

  RegionId self() const { return neighborhood_.self(); }

  // --- Packets that are for a record here.
  // Whether it was: the record, or its tombstone, is here.
  bool TakeHere(const Packet& packet, Tick now);
  void TakeMessage(const Packet& packet, Tick now);
  void TakeAcknowledgement(const Packet& packet, Tick now);
  void TakeConfirmation(const Packet& packet, Tick now);
  // The target of these messages is gone.
  void DropTo(BodyId sender, BodyId target);
  void TakeInstance(const Packet& packet);
  void AnswerForRemoved(const Packet& packet, Tick now);
  // Replaces the messages of a record.
  template <class Change>
  void ChangeMail(BodyId id, const Change& change);
  void EndIfDone(BodyId id, Tick now);

  // --- Packets that go on.
  void Route(Packet packet, RegionId from, Tick now);
  void Flood(const Packet& packet, RegionId from);
  void Direct(const Packet& packet);
  void RouteQuestion(const Packet& packet, Tick now);
  void Emit(Packet packet, Tick now);     // one of this region's
  void Later(Packet packet, Tick since);  // once the standby has this tick
  RegionId WhereIs(BodyId id) const;
  void NotePlace(BodyId id, RegionId region, Tick now);

  // --- The end of a step.
  void SendOutboxes(Tick now, std::optional<Tick> standby_has);
  void Remind(Tick now);
  void PublishInstance(Tick now);
  void ForgetOld(Tick now);

  const Catalog& catalog_;
  const Neighborhood& neighborhood_;
  const Borders& borders_;
  const Bodies& bodies_;
  RecordTable& records_;
  Ownership& ownership_;
  Tombstones& tombstones_;
  OutgoingMessages& outgoing_;
  QuestionDesk& questions_;

  Routes routes_;
  std::vector<std::pair<Tick, Packet>> later_;  // by the tick that the standby must have
  std::map<std::pair<BodyId, std::uint64_t>, Attempt> attempts_;
  std::map<BodyId, Place> places_;                              // last known, of records elsewhere
  std::map<BodyId, Place> came_from_;                           // places of those that came lately
  std::map<Tick, std::set<FloodKey>> flooded_;                  // by when they were sent
  std::shared_ptr<const std::vector<std::uint8_t>> published_;  // properties of the world, of published_epoch_
  Epoch published_epoch_;
  Tick published_at_;
  std::deque<InstanceVersion> instance_;  // ascending by (epoch, made)
  bool waits_ = false;
  RelayStatistics statistics_;
};

}  // namespace tessera::region
