#include "tests/simulation/worker.h"

#include <algorithm>

namespace tessera::simulation {

Worker::Worker(Timeline& timeline, VirtualNetwork& network, region::Config config, Node life)
    : timeline_(timeline),
      network_(network),
      region_(std::make_unique<region::Region>(config)),
      node_(NodeOf(config.self, life)),
      links_itself_(life == 0),
      period_(1'000'000 / config.scene->tick_rate_hz) {}

Worker::~Worker() {
  *alive_ = false;
  network_.Leave(node());
}

void Worker::Start() {
  due_ = timeline_.now() + period_;
  last_step_ = timeline_.now();
  Send(region_->Start());
  network_.Join(node(), {.on_connected =
                             [this](Node peer) {
                               const auto found = peers_.find(RegionAt(peer));
                               if (found == peers_.end()) return;
                               for (const region::Bytes& frame : found->second.kept) SendFrame(found->first, frame);
                             },
                         .on_disconnected = [](Node) {},
                         .on_message = [this](Node from, const Bytes& message) { OnMessage(from, message); },
                         .on_datagram =
                             [this](Node from, const Bytes& bytes) {
                               if (on_datagram) on_datagram(from, bytes);
                             }});
  if (links_itself_) {
    for (const RegionId neighbor : region_->neighbors()) network_.Link(node(), neighbor.value());
  }
  WakeAt(due_);
  Care(timeline_.now() + kCare);
}

Node Worker::AddressOf(RegionId region) const {
  const auto found = addresses_.find(region);
  return found == addresses_.end() ? region.value() : found->second;
}

void Worker::SendFrame(RegionId to, const region::Bytes& frame) {
  Bytes message;
  message.reserve(frame.size() + 1);
  message.push_back(kFrameKind);
  message.insert(message.end(), frame.begin(), frame.end());
  (void)network_.Send(node(), AddressOf(to), std::move(message));
}

bool Worker::SendOther(Node to, std::uint8_t kind, const Bytes& bytes) {
  Bytes message = {kind};
  message.insert(message.end(), bytes.begin(), bytes.end());
  return network_.Send(node(), to, std::move(message));
}

void Worker::Send(std::vector<region::OutgoingFrame> frames) {
  for (region::OutgoingFrame& frame : frames) {
    ++totals_.frames;
    totals_.frame_bytes += frame.bytes.size();
    Peer& peer = peers_[frame.to];
    SendFrame(frame.to, frame.bytes);
    if (peer.kept.size() == kFramesKept) peer.kept.pop_front();
    peer.kept.push_back(std::move(frame.bytes));
  }
}

void Worker::OnMessage(Node from, const Bytes& message) {
  if (message.empty() || (admits && !admits(from))) return;
  const std::span<const std::uint8_t> payload = std::span(message).subspan(1);
  if (message[0] != kFrameKind) {
    if (on_other) on_other(*this, from, message[0], payload);
    return;
  }
  const RegionId region = RegionAt(from);
  peers_[region].heard = timeline_.now();
  const absl::Status status = region_->Receive(region, payload);
  if (!status.ok()) {
    ++totals_.refused[std::string(status.message())];
    if (on_refused) on_refused(*this, region, status);
  }
  Advance();
}

void Worker::WakeAt(Micros time) {
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

void Worker::Advance() {
  while (true) {
    const Micros now = timeline_.now(), ready = std::max(due_, busy_until_);
    if (region_->tick() >= target_) return;
    if (now < ready) return WakeAt(ready);
    if ((may_step && !may_step()) || !region_->CanStep()) return;
    Step();
    due_ += period_;
    if (due_ + 4 * period_ < now) due_ = now;  // what was missed long ago is not caught up with
    busy_until_ = now + step_time_;
    last_step_ = now;
  }
}

void Worker::Step() {
  if (before_step) before_step();
  std::vector<RegionId> closed;
  for (const RegionId id : region_->neighbors()) {
    if (!region_->IsOpen(id)) closed.push_back(id);
  }
  region::StepResult result = region_->Step();
  ++totals_.steps;
  stepped_ = true;
  totals_.openings += static_cast<std::uint64_t>(
      std::count_if(closed.begin(), closed.end(), [this](RegionId id) { return region_->IsOpen(id); }));
  Send(std::move(result.frames));
  if (on_step) on_step(*this, result);
}

// Now and then: says that it lives to whom it has nothing new to say, and looks who is silent.
void Worker::Care(Micros due) {
  const Micros now = timeline_.now();
  const std::vector<RegionId> missing = region_->WaitingFor();
  const bool stepped = last_step_ + kCare > now;
  const bool stood_still = now > due + kCare;  // then what is silent was only not listened to
  const bool cares = !may_care || may_care();
  for (auto& [id, peer] : peers_) {
    const bool waited = std::find(missing.begin(), missing.end(), id) != missing.end();
    if (!waited || !peer.waited || stood_still || stepped) peer.waited_since = now;
    peer.waited = waited;
    // One that joins waits for the tick from which its neighbours know it.
    const bool silent = now - std::max(peer.heard, peer.waited_since) >= kSilence;
    if (waited && stepped_ && cares && !region_->halted() && (silent || now - peer.waited_since >= kStuck)) {
      ++totals_.closings;
      region_->Close(id);
    }
    if (cares && now - last_step_ >= kCare && !peer.kept.empty()) SendFrame(id, peer.kept.back());
  }
  timeline_.In(kCare, [this, alive = alive_, due = now + kCare] {
    if (!*alive) return;
    network_.InProcess(node(), [this, alive, due] {
      if (*alive) Care(due);
    });
  });
  Advance();
}

}  // namespace tessera::simulation
