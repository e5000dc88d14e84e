#include "tests/simulation/virtual_network.h"

#include <algorithm>
#include <utility>

namespace tessera::simulation {
namespace {

constexpr Micros kHeldBack = Milliseconds(5);  // delays a packet that is to be overtaken

}  // namespace

void VirtualNetwork::Join(Node node, Process process) {
  if (Joined(node)) Leave(node);
  std::vector<Ends> mine;
  for (const auto& [ends, connection] : connections_) {
    if (ends.first == node || ends.second == node) mine.push_back(ends);
  }
  for (const Ends& ends : mine) Break(ends.first, ends.second);  // the last life's, if nobody noticed its end yet
  NodeState& state = nodes_[node];
  state.process = std::move(process);
  state.life = ++lives_;
  for (const Ends& ends : mine) Dial(ends, 0);
}

void VirtualNetwork::Leave(Node node) {
  nodes_.erase(node);
  for (const auto& [ends, connection] : connections_) {
    if (!connection.up || (ends.first != node && ends.second != node)) continue;
    const std::uint64_t session = connection.session;
    timeline_.In(break_after_, [this, ends = ends, session] {
      if (Session(ends.first, ends.second) == session) Break(ends.first, ends.second);
    });
  }
}

void VirtualNetwork::Link(Node a, Node b) {
  if (connections_.try_emplace(Pair(a, b)).second) Dial(Pair(a, b), 0);
}

void VirtualNetwork::Unlink(Node a, Node b) { connections_.erase(Pair(a, b)); }

std::uint64_t VirtualNetwork::Session(Node a, Node b) const {
  const auto found = connections_.find(Pair(a, b));
  return found != connections_.end() && found->second.up ? found->second.session : 0;
}

void VirtualNetwork::Cut(Node a, Node b, bool cut) {
  if (cut) {
    cuts_.insert(Pair(a, b));
  } else {
    cuts_.erase(Pair(a, b));
  }
}

void VirtualNetwork::CutOneWay(Node from, Node to, bool cut) {
  if (cut) {
    cuts_one_way_.insert({from, to});
  } else {
    cuts_one_way_.erase({from, to});
  }
}

bool VirtualNetwork::Passes(Node from, Node to) const {
  return !IsCut(from, to) && !cuts_one_way_.contains({from, to});
}

void VirtualNetwork::MovePlace(std::uint32_t place, std::uint32_t island) {
  if (island == 0) {
    islands_.erase(place);
  } else {
    islands_[place] = island;
  }
}

void VirtualNetwork::CutPlace(std::uint32_t place, bool cut) {
  if (cut) {
    cut_places_.insert(place);
  } else {
    cut_places_.erase(place);
  }
}

bool VirtualNetwork::IsCut(Node a, Node b) const {
  if (cuts_.contains(Pair(a, b))) return true;
  if (cut_places_.empty() && islands_.empty()) return false;
  const auto at = [this](Node node) {
    const auto found = places_.find(node);
    return found == places_.end() ? 0 : found->second;
  };
  const auto island = [this](std::uint32_t place) {
    const auto found = islands_.find(place);
    return found == islands_.end() ? 0 : found->second;
  };
  if (at(a) == at(b)) return false;
  return cut_places_.contains(at(a)) || cut_places_.contains(at(b)) || island(at(a)) != island(at(b));
}

bool VirtualNetwork::IsStalled(Node node) const {
  const auto found = nodes_.find(node);
  return found != nodes_.end() && found->second.stalled;
}

void VirtualNetwork::SetStalled(Node node, bool stalled) {
  const auto found = nodes_.find(node);
  if (found == nodes_.end()) return;
  found->second.stalled = stalled;
  if (stalled) return;
  const std::uint64_t life = found->second.life;
  const std::vector<std::function<void()>> waiting = std::exchange(found->second.backlog, {});
  for (auto action = waiting.begin(); action != waiting.end(); ++action) {
    const auto now = nodes_.find(node);
    if (now == nodes_.end() || now->second.life != life) return;
    if (now->second.stalled) {  // again, by what it just did
      now->second.backlog.insert(now->second.backlog.begin(), action, waiting.end());
      return;
    }
    (*action)();
  }
}

void VirtualNetwork::InProcess(Node node, std::function<void()> action) {
  const auto found = nodes_.find(node);
  if (found == nodes_.end()) return;
  if (found->second.stalled) {
    found->second.backlog.push_back(std::move(action));
  } else {
    action();
  }
}

// Sends one packet under the network conditions: it arrives never, once or twice.
void VirtualNetwork::Travel(Node from, Node to, const std::function<void()>& arrive) {
  ++totals_.packets;
  if (!Passes(from, to) || chance_.Happens(conditions_.loss)) {
    ++totals_.lost;
    return;
  }
  const auto once = [&] {
    const Micros delay = conditions_.delay + chance_.UpTo(conditions_.jitter);
    timeline_.In(delay + (chance_.Happens(conditions_.reorder) ? kHeldBack : 0), arrive);
  };
  once();
  if (chance_.Happens(conditions_.duplicate)) {
    ++totals_.duplicates;
    once();
  }
}

bool VirtualNetwork::Send(Node from, Node to, Bytes bytes) {
  const auto found = connections_.find(Pair(from, to));
  if (found == connections_.end() || !found->second.up) return false;
  Stream& stream = found->second.streams[from < to ? 0 : 1];
  Transmit({from, to, found->second.session, stream.next_out++, std::make_shared<const Bytes>(std::move(bytes)),
            timeline_.now(), kResendAfter});
  return true;
}

void VirtualNetwork::SendDatagram(Node from, Node to, Bytes bytes) {
  const auto shared = std::make_shared<const Bytes>(std::move(bytes));
  Travel(from, to, [this, from, to, shared] {
    InProcess(to, [this, from, to, shared] {
      const auto found = nodes_.find(to);
      if (found != nodes_.end() && found->second.process.on_datagram) found->second.process.on_datagram(from, *shared);
    });
  });
}

bool VirtualNetwork::Current(const Packet& packet) const {
  const auto found = connections_.find(Pair(packet.from, packet.to));
  return found != connections_.end() && found->second.up && found->second.session == packet.session;
}

bool VirtualNetwork::Heard(const Packet& packet) const {
  const Stream& stream = connections_.at(Pair(packet.from, packet.to)).streams[packet.from < packet.to ? 0 : 1];
  return packet.number < stream.next_in || stream.early.contains(packet.number);
}

// Its sender learns of that, unless nothing passes back.
bool VirtualNetwork::Acknowledged(const Packet& packet) const {
  return Heard(packet) && !cuts_one_way_.contains({packet.to, packet.from});
}

// Sent, and sent again until it is heard; a receiver that stands still hears nothing.
void VirtualNetwork::Transmit(const Packet& packet) {
  Travel(packet.from, packet.to, [this, packet] { Arrive(packet); });
  timeline_.In(packet.resend_after, [this, packet] {
    if (!Current(packet) || Acknowledged(packet) || !Joined(packet.from)) return;
    InProcess(packet.from, [this, packet] {
      if (!Current(packet) || Acknowledged(packet)) return;
      if (timeline_.now() - packet.first_sent >= break_after_) return Break(packet.from, packet.to);
      ++totals_.resent;
      Packet again = packet;
      again.resend_after = std::min(packet.resend_after * 2, kMaxResendAfter);
      Transmit(again);
    });
  });
}

void VirtualNetwork::Arrive(const Packet& packet) {
  InProcess(packet.to, [this, packet] {
    if (!Current(packet) || Heard(packet)) return;
    Stream& stream = connections_.at(Pair(packet.from, packet.to)).streams[packet.from < packet.to ? 0 : 1];
    stream.early.emplace(packet.number, packet.bytes);
    // A message may break the connection, or end the process.
    while (Current(packet) && !stream.early.empty() && stream.early.begin()->first == stream.next_in) {
      const std::shared_ptr<const Bytes> bytes = stream.early.begin()->second;
      stream.early.erase(stream.early.begin());
      ++stream.next_in;
      const auto found = nodes_.find(packet.to);
      if (found == nodes_.end()) return;
      if (found->second.process.on_message) found->second.process.on_message(packet.from, *bytes);
    }
  });
}

void VirtualNetwork::Break(Node a, Node b) {
  const Ends ends = Pair(a, b);
  const auto found = connections_.find(ends);
  if (found == connections_.end() || !found->second.up) return;
  found->second.up = false;
  ++totals_.breaks;
  for (const auto& [node, peer] : {ends, Ends(ends.second, ends.first)}) {
    InProcess(node, [this, node = node, peer = peer] {
      const auto state = nodes_.find(node);
      if (state != nodes_.end() && state->second.process.on_disconnected) state->second.process.on_disconnected(peer);
    });
  }
  Dial(ends, kRedialAfter);
}

// A handshake of three packets; one that fails is tried again.
void VirtualNetwork::Dial(Ends ends, Micros after) {
  timeline_.In(after + 3 * conditions_.delay + chance_.UpTo(conditions_.jitter), [this, ends] {
    const auto found = connections_.find(ends);
    if (found == connections_.end() || found->second.up) return;
    if (!Joined(ends.first) || !Joined(ends.second)) return;  // `Join` dials
    const bool lost = chance_.Happens(conditions_.loss) || chance_.Happens(conditions_.loss);
    const bool passes = Passes(ends.first, ends.second) && Passes(ends.second, ends.first);
    if (!passes || IsStalled(ends.first) || IsStalled(ends.second) || lost) {
      return Dial(ends, kRedialAfter);
    }
    Open(ends);
  });
}

void VirtualNetwork::Open(Ends ends) {
  Connection& connection = connections_.at(ends);
  connection.up = true;
  connection.session = ++sessions_;
  connection.streams = {};
  for (const auto& [node, peer] : {ends, Ends(ends.second, ends.first)}) {
    const auto state = nodes_.find(node);
    if (state != nodes_.end() && state->second.process.on_connected) state->second.process.on_connected(peer);
  }
}

}  // namespace tessera::simulation
