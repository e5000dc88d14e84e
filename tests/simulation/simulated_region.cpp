#include "tests/simulation/simulated_region.h"

#include <algorithm>
#include <utility>

#include "region_worker/core/link_message.h"
#include "tests/simulation/virtual_time.h"

namespace tessera::simulation {
namespace {

constexpr Micros kRound = Milliseconds(20);  // between looks at what is silent, as in the product

}  // namespace

SimulatedRegion::SimulatedRegion(Timeline& timeline, VirtualNetwork& network, region::Config config)
    : timeline_(timeline), network_(network), links_(config.self), ticks_(std::move(config)) {}

SimulatedRegion::~SimulatedRegion() {
  *alive_ = false;
  network_.Leave(node());
}

void SimulatedRegion::Start() {
  ticks_.SendFirstFrames(links_, actions_);
  ticks_.Run(TimePointAt(timeline_.now()));
  CarryOut();
  network_.Join(node(), {.on_connected =
                             [this](Node peer) {
                               links_.Up(RegionId(peer), Incarnation(), TimePointAt(timeline_.now()), actions_);
                               CarryOut();
                             },
                         .on_disconnected = [this](Node peer) { links_.Down(RegionId(peer)); },
                         .on_message = [this](Node from, const Bytes& message) { OnMessage(from, message); },
                         .on_datagram =
                             [this](Node from, const Bytes& bytes) {
                               if (on_datagram) on_datagram(from, bytes);
                             }});
  for (const RegionId neighbor : region().neighbors()) network_.Link(node(), neighbor.value());
  WakeAt(timeline_.now());
}

void SimulatedRegion::CarryOut() {
  for (const worker::Action& action : std::exchange(actions_, {})) {
    if (const auto* send = std::get_if<worker::SendMessage>(&action)) {
      (void)network_.Send(node(), send->to.value(), *send->message);
    }
  }
}

bool SimulatedRegion::SendOther(Node to, std::uint8_t kind, const Bytes& bytes) {
  Bytes message = {kind};
  message.insert(message.end(), bytes.begin(), bytes.end());
  return network_.Send(node(), to, std::move(message));
}

void SimulatedRegion::Resumed(region::StepResult result) {
  links_.SendFrames(std::exchange(result.frames, {}), actions_);
  CarryOut();
  ticks_.Restart(TimePointAt(timeline_.now()));
  if (on_step) on_step(*this, result);
  Advance();
}

void SimulatedRegion::OnMessage(Node from, const Bytes& message) {
  if (message.empty()) return;
  const RegionId sender(from);
  if (message[0] >= kFirstOtherKind) {
    if (on_other) on_other(*this, from, message[0], std::span(message).subspan(1));
    return;
  }
  links_.Heard(sender, TimePointAt(timeline_.now()));
  const auto read = worker::ReadLinkMessage(message);
  if (read && read->kind == worker::LinkMessageKind::kFrame) {
    const absl::Status status = region().Receive(sender, read->bytes);
    if (!status.ok()) ++totals_.refused[std::string(status.message())];
  }
  Advance();
}

void SimulatedRegion::WakeAt(Micros time) {
  if (wake_ && *wake_ <= time) return;
  wake_ = time;
  timeline_.At(time, [this, alive = alive_, time] {
    if (!*alive) return;
    network_.InProcess(node(), [this, alive, time] {
      if (!*alive || wake_ != time) return;
      wake_.reset();
      Advance();
    });
  });
}

void SimulatedRegion::Advance() {
  while (true) {
    const Micros now = timeline_.now();
    if (now < busy_until_) return WakeAt(busy_until_);
    if (region().tick() >= target_ || !ticks_.Due(TimePointAt(now))) break;
    Step();
  }
  const Micros now = timeline_.now();
  ticks_.Watch(TimePointAt(now), ticks_.stepped(), links_, actions_);  // one that joins waits for its tick
  CarryOut();
  const auto due = ticks_.wake_at(TimePointAt(now));
  WakeAt(due ? std::min(MicrosAt(*due), now + kRound) : now + kRound);
}

void SimulatedRegion::Step() {
  if (before_step) before_step();
  std::vector<RegionId> closed;
  for (const RegionId id : region().neighbors()) {
    if (!region().IsLinkUp(id)) closed.push_back(id);
  }
  const worker::TimePoint now = TimePointAt(timeline_.now());
  const region::StepResult result = ticks_.Step(now, {}, links_, actions_);
  ++totals_.steps;
  totals_.frames += static_cast<std::uint64_t>(std::ranges::count_if(
      actions_, [](const worker::Action& action) { return std::holds_alternative<worker::SendMessage>(action); }));
  totals_.openings +=
      static_cast<std::uint64_t>(std::ranges::count_if(closed, [this](RegionId id) { return region().IsLinkUp(id); }));
  CarryOut();
  if (on_step) on_step(*this, result);
  (void)ticks_.StepEnded(now + std::chrono::microseconds(step_time_));
  busy_until_ = timeline_.now() + step_time_;
}

RegionTotals SimulatedRegion::totals() const {
  RegionTotals totals = totals_;
  totals.closings = ticks_.links_down();
  return totals;
}

}  // namespace tessera::simulation
