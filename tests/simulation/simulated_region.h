// SimulatedRegion: one region in virtual time, driven by the product's own TickDriver: that paces its ticks, keeps the
// last frames for new links, says that the region is well while it waits, and gives silent neighbours up.
//
// Messages of other kinds than the product's belong to whoever asks for them: `on_other`, `SendOther`. Thread rule: one
// thread at a time.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "core/region/region.h"
#include "region_worker/core/tick_driver.h"
#include "tests/simulation/virtual_network.h"

namespace tessera::simulation {

struct RegionTotals {
  std::uint64_t steps = 0, frames = 0, closings = 0, openings = 0;
  std::map<std::string, std::uint64_t> refused;  // frames, by the reason that was given
};

class SimulatedRegion {
 public:
  // Messages that begin with this byte or a higher one are `on_other`'s.
  static constexpr std::uint8_t kFirstOtherKind = 200;

  using OnStep = std::function<void(SimulatedRegion&, const region::StepResult&)>;

  SimulatedRegion(Timeline& timeline, VirtualNetwork& network, region::Config config);
  ~SimulatedRegion();

  // Joins the network as the node of the region's number, links to the neighbours and sends the frames of the region's
  // present tick.
  void Start();
  // False: no connection.
  bool SendOther(Node to, std::uint8_t kind, const Bytes& bytes);
  // Sends the result of a call that resumed the region, and goes on from now.
  void Resumed(region::StepResult result);
  // Steps while a tick is due and its frames are here. Call it when something changed that a step may wait for.
  void Advance();

  OnStep on_step;  // its result's frames have been sent
  std::function<void(SimulatedRegion&, Node from, std::uint8_t kind, std::span<const std::uint8_t>)> on_other;
  std::function<void(Node from, const Bytes&)> on_datagram;
  std::function<void()> before_step;  // e.g. to queue inputs

  region::Region& region() { return ticks_.region(); }
  const region::Region& region() const { return ticks_.region(); }
  RegionId id() const { return region().id(); }
  Node node() const { return id().value(); }
  RegionTotals totals() const;
  // A step takes so long: a tick that takes longer than its share slows the instance down.
  void set_step_time(Micros time) { step_time_ = time; }
  // It steps no further than this.
  void set_target(Tick target) { target_ = target; }

 private:
  void Step();
  void OnMessage(Node from, const Bytes& message);
  void CarryOut();
  void WakeAt(Micros time);

  Timeline& timeline_;
  VirtualNetwork& network_;
  worker::LinkTable links_;
  worker::TickDriver ticks_;
  worker::Actions actions_;
  Micros step_time_ = 0, busy_until_ = 0;
  std::optional<Micros> wake_;
  Tick target_{~Tick::rep{0} >> 1};
  RegionTotals totals_;
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
};

}  // namespace tessera::simulation
