// Worker: one region with the shell around it, as region_worker has it, in virtual time: it paces ticks, links to its
// neighbours, sends its last two frames again on a new connection, says that it lives while it waits, closes borders
// that are silent.
//
// Messages of other kinds than frames belong to whoever asks for them: `on_other`, `SendOther`. Thread rule: one thread
// at a time.
#pragma once

#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>

#include "core/region/region.h"
#include "tests/simulation/virtual_network.h"

namespace tessera::simulation {

struct WorkerTotals {
  std::uint64_t steps = 0, frames = 0, frame_bytes = 0, closings = 0, openings = 0;
  std::map<std::string, std::uint64_t> refused;  // frames, by what was said of them
};

// Where a life of a region is: several lives of one may be there at once. The first is a node of the region's number.
constexpr Node kNodesOfALife = 4096;
constexpr Node NodeOf(RegionId region, Node life) { return life * kNodesOfALife + region.value(); }
constexpr RegionId RegionAt(Node node) { return RegionId(node % kNodesOfALife); }

class Worker {
 public:
  static constexpr Micros kSilence = Milliseconds(250);  // of a neighbour that is waited for, until its border closes
  // Of one that is heard and makes no step: regions may wait for each other in a circle.
  static constexpr Micros kStuck = Milliseconds(1000);
  static constexpr Micros kCare = Milliseconds(50);  // between looks at what is silent
  static constexpr std::size_t kFramesKept = 2;
  static constexpr std::uint8_t kFrameKind = 0;  // first byte of a message

  using OnStep = std::function<void(Worker&, const region::StepResult&)>;

  // With a life, whom it links to is the caller's care, and so is telling it by `SetAddress` where others are.
  Worker(Timeline& timeline, VirtualNetwork& network, region::Config config, Node life = 0);
  ~Worker();

  // Joins the network and sends the frames of the region's present tick.
  void Start();
  // Of other kinds than frames; false: no connection.
  bool SendOther(Node to, std::uint8_t kind, const Bytes& bytes);
  // From a call that changed the region: sends what it returned.
  void Send(std::vector<region::OutgoingFrame> frames);
  // Steps while a tick is due and its frames are here. Call it when something changed that a step may wait for.
  void Advance();

  OnStep on_step;
  std::function<void(Worker&, Node from, std::uint8_t kind, std::span<const std::uint8_t>)> on_other;
  std::function<void(Worker&, RegionId from, const absl::Status&)> on_refused;
  std::function<void(Node from, const Bytes&)> on_datagram;
  std::function<bool()> may_step;     // false: paused, e.g. without a lease
  std::function<bool()> may_care;     // false: says nothing to anybody and gives nobody up
  std::function<bool(Node)> admits;   // false: what comes from there is not heard
  std::function<void()> before_step;  // e.g. to queue inputs

  region::Region& region() { return *region_; }
  const region::Region& region() const { return *region_; }
  RegionId id() const { return region_->id(); }
  Node node() const { return node_; }
  void SetAddress(RegionId region, Node node) { addresses_[region] = node; }
  Node AddressOf(RegionId region) const;
  // That life has ended: its frames are not for the next one.
  void DropKept(RegionId region) { peers_[region].kept.clear(); }
  const WorkerTotals& totals() const { return totals_; }
  // A step takes so long: a tick that takes longer than its share slows the instance down.
  void set_step_time(Micros time) { step_time_ = time; }
  // It steps no further than this.
  void set_target(Tick target) { target_ = target; }
  Tick target() const { return target_; }

 private:
  struct Peer {
    std::deque<region::Bytes> kept;
    Micros heard = 0, waited_since = 0;
    bool waited = false;
  };
  void Step();
  void OnMessage(Node from, const Bytes& message);
  void Care(Micros due);
  void WakeAt(Micros time);
  void SendFrame(RegionId to, const region::Bytes& frame);

  Timeline& timeline_;
  VirtualNetwork& network_;
  std::unique_ptr<region::Region> region_;
  Node node_;
  bool links_itself_;
  std::map<RegionId, Node> addresses_;
  std::map<RegionId, Peer> peers_;
  Micros period_, due_ = 0, step_time_ = 0, busy_until_ = 0, last_step_ = 0;
  std::optional<Micros> wake_;
  bool stepped_ = false;
  Tick target_{~Tick::rep{0} >> 1};
  WorkerTotals totals_;
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
};

}  // namespace tessera::simulation
