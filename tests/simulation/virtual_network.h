// VirtualNetwork: what lies between the processes of an instance: packets that are lost, late, doubled and overtaken,
// hosts that cannot hear each other, processes that stand still. On it, as over ENet: connections that are reliable and
// ordered and break when nothing comes through, and datagrams.
//
// A reliable message is a packet that is sent again until it has come through; the receiver puts packets in order and
// drops those that it has. A connection on which a packet stays unheard for break_after ends for both, loses what was
// on its way, and is dialled again.
//
//   VirtualNetwork network(timeline, seed);
//   network.Join(1, {.on_message = ...});
//   network.Link(1, 2);                   // dials until there is a connection, and after each break
//   network.Send(1, 2, bytes);            // false: no connection
//
// Thread rule: one thread at a time.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <vector>

#include "tests/simulation/chance.h"
#include "tests/simulation/timeline.h"

namespace tessera::simulation {

using Bytes = std::vector<std::uint8_t>;
using Node = std::uint32_t;
// So many nodes are of one life of a region (simulated_links.h), a few of them of what is no region. Lives may come to
// eight million: each backup that is put back adds a million.
constexpr Node kNodesOfALife = 512;

// Network conditions, which hold for every packet, each way.
struct PacketConditions {
  double loss = 0;       // share that never comes
  Micros delay = 300;    // one way
  Micros jitter = 0;     // at most so much more, so that packets overtake each other
  double reorder = 0;    // share that comes 5 ms later still
  double duplicate = 0;  // share that comes twice
};

struct NetworkTotals {
  std::uint64_t packets = 0, lost = 0, duplicates = 0, resent = 0, breaks = 0;
};

class VirtualNetwork {
 public:
  static constexpr Micros kResendAfter = Milliseconds(30);  // at first; doubles
  static constexpr Micros kMaxResendAfter = Milliseconds(120);
  static constexpr Micros kBreakAfter = Milliseconds(1200);  // unless it is set
  static constexpr Micros kRedialAfter = Milliseconds(20);

  struct Process {
    std::function<void(Node peer)> on_connected, on_disconnected;
    std::function<void(Node from, const Bytes&)> on_message, on_datagram;
  };

  VirtualNetwork(Timeline& timeline, std::uint64_t seed) : timeline_(timeline), chance_(seed) {}

  void Join(Node node, Process process);
  void Leave(Node node);  // its process ends: peers notice by silence
  bool Joined(Node node) const { return nodes_.contains(node); }
  // From now on there is to be a connection between the two, whenever both have joined.
  void Link(Node a, Node b);
  void Unlink(Node a, Node b);
  bool Connected(Node a, Node b) const { return Session(a, b) != 0; }
  std::uint64_t Session(Node a, Node b) const;  // another number for each connection; 0: there is none

  // Runs `action` in the process: at once, or when it goes on; never if it has ended. Its timers act by this.
  void InProcess(Node node, std::function<void()> action);

  bool Send(Node from, Node to, Bytes bytes);
  void SendDatagram(Node from, Node to, Bytes bytes);

  // --- Faults.
  PacketConditions& conditions() { return conditions_; }
  void set_break_after(Micros time) { break_after_ = time; }
  void Cut(Node a, Node b, bool cut);  // no packet passes
  // None passes from the one to the other. A connection ends when the sender hears no acknowledgement, or is not heard.
  void CutOneWay(Node from, Node to, bool cut);
  void ClearCuts() {
    cuts_.clear();
    cuts_one_way_.clear();
    cut_places_.clear();
    islands_.clear();
  }
  bool IsCut(Node a, Node b) const;       // both ways
  bool Passes(Node from, Node to) const;  // packets do, but for loss
  // A place is a machine. One that is cut off is heard by nobody elsewhere; what is there goes on hearing each other.
  void SetPlace(Node node, std::uint32_t place) { places_[node] = place; }
  void CutPlace(std::uint32_t place, bool cut);
  // Places of one island hear each other and nobody else. 0: where all are at first.
  void MovePlace(std::uint32_t place, std::uint32_t island);
  void Break(Node a, Node b);                // their connection, at once
  void SetStalled(Node node, bool stalled);  // it runs no code; what comes waits for it
  bool IsStalled(Node node) const;

  const NetworkTotals& totals() const { return totals_; }

 private:
  using Ends = std::pair<Node, Node>;
  struct Stream {  // one direction of a connection
    std::uint64_t next_out = 0, next_in = 0;
    std::map<std::uint64_t, std::shared_ptr<const Bytes>> early;
  };
  struct Connection {
    bool up = false;
    std::uint64_t session = 0;
    std::array<Stream, 2> streams;  // from the lower node; from the higher
  };
  struct NodeState {
    Process process;
    std::uint64_t life = 0;
    bool stalled = false;
    std::vector<std::function<void()>> backlog;  // came while it stood still
  };
  struct Packet {
    Node from = 0, to = 0;
    std::uint64_t session = 0, number = 0;
    std::shared_ptr<const Bytes> bytes;
    Micros first_sent = 0;
    Micros resend_after = kResendAfter;
  };

  static Ends Pair(Node a, Node b) { return a < b ? Ends(a, b) : Ends(b, a); }
  void Travel(Node from, Node to, const std::function<void()>& arrive);
  void Transmit(const Packet& packet);
  void Arrive(const Packet& packet);
  void Dial(Ends ends, Micros after);
  void Open(Ends ends);
  bool Heard(const Packet& packet) const;
  bool Acknowledged(const Packet& packet) const;
  bool Current(const Packet& packet) const;

  Timeline& timeline_;
  Chance chance_;
  PacketConditions conditions_;
  Micros break_after_ = kBreakAfter;
  std::map<Node, NodeState> nodes_;
  std::map<Ends, Connection> connections_;
  std::set<Ends> cuts_;
  std::set<Ends> cuts_one_way_;  // from, to
  std::map<Node, std::uint32_t> places_;
  std::set<std::uint32_t> cut_places_;
  std::map<std::uint32_t, std::uint32_t> islands_;  // by place
  std::uint64_t lives_ = 0, sessions_ = 0;
  NetworkTotals totals_;
};

}  // namespace tessera::simulation
