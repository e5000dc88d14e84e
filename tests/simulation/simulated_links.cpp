#include "tests/simulation/simulated_links.h"

#include <utility>

namespace tessera::simulation {
namespace {

constexpr RegionId RegionAt(Node node) { return RegionId(node % kNodesOfALife); }
constexpr Incarnation LifeAt(Node node) { return Incarnation(node / kNodesOfALife); }

}  // namespace

SimulatedLinks::SimulatedLinks(VirtualNetwork& network, Node self, std::uint32_t place)
    : network_(network), self_(self) {
  network_.SetPlace(self_, place);
}

void SimulatedLinks::Open(const worker::LinkTable& table, Events events) {
  table_ = &table;
  events_ = std::move(events);
  network_.Join(self_, {.on_connected = [this](Node peer) { OnConnected(peer); },
                        .on_disconnected = [this](Node peer) { OnDisconnected(peer); },
                        .on_message = [this](Node from, const Bytes& bytes) { events_.message(RegionAt(from), bytes); },
                        .on_datagram = {}});
}

void SimulatedLinks::OnConnected(Node peer) {
  const RegionId region = RegionAt(peer);
  if (table_ == nullptr || !table_->Admit(region, LifeAt(peer)).ok()) return network_.Break(self_, peer);
  if (const auto older = linked_.find(region); older != linked_.end()) network_.Break(self_, older->second);
  linked_[region] = peer;
  events_.up(region, LifeAt(peer));
}

void SimulatedLinks::OnDisconnected(Node peer) {
  const auto linked = linked_.find(RegionAt(peer));
  if (linked == linked_.end() || linked->second != peer) return;
  linked_.erase(linked);
  events_.down(RegionAt(peer));
}

void SimulatedLinks::Dial(const worker::LinkTable& table) {
  for (const RegionId partner : table.partners()) {
    if (table.Dials(partner)) network_.Link(self_, NodeOf(partner, table.AddressOf(partner)->incarnation));
  }
}

void SimulatedLinks::Send(RegionId to, const Bytes& message) {
  const auto linked = linked_.find(to);
  if (linked != linked_.end()) (void)network_.Send(self_, linked->second, message);
}

void SimulatedLinks::Cut(RegionId region) {
  const auto linked = linked_.find(region);
  if (linked == linked_.end()) return;
  const Node peer = linked->second;
  linked_.erase(linked);
  network_.Break(self_, peer);
  network_.Unlink(self_, peer);
}

void SimulatedLinks::InProcess(const std::function<void()>& action) {
  network_.Joined(self_) ? network_.InProcess(self_, action) : action();
}

}  // namespace tessera::simulation
