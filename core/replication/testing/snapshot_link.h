// SnapshotLink, for tests: one region and one client, and a network between them that loses, doubles and reorders, from
// a seed.
#pragma once

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <set>

#include "core/replication/quantize.h"
#include "core/replication/snapshot.h"

namespace tessera::replication {

using Truth = std::map<BodyId, BodyRecord>;  // as a client should see it: quantised

class SnapshotLink {
 public:
  struct Network {
    double loss = 0, duplicate = 0;
    int max_delay = 0;  // snapshots; each datagram's own
    unsigned seed = 1;
    double ack_loss = 0;  // besides
  };

  SnapshotLink(const Aabb& bounds, const Network& network, const SnapshotSettings& settings = {})
      : network_(network),
        random_(network.seed),
        quantizer_(bounds, settings),
        history_(bounds, settings),
        sender_(settings),
        receiver_(bounds, settings) {}

  WrittenSnapshot Snapshot(std::span<const BodyRecord> bodies, std::span<const DepartureRecord> departures = {}) {
    tick_ = tick_ + 2;
    Truth& now = truth_[tick_];
    for (const BodyRecord& body : bodies) {
      now[body.id] = {body.id, body.epoch, quantizer_.Dequantize(quantizer_.Quantize(body.state))};
    }
    history_.Push(tick_, bodies, departures);
    WrittenSnapshot written = sender_.Write(history_, 7, -3);
    for (const Bytes& datagram : written.datagrams) Post(datagram, down_);
    Deliver();
    if (Uniform() >= network_.ack_loss) Post(receiver_.WriteAck(), up_);
    for (auto at = up_.begin(); at != up_.end() && at->first <= now_; at = up_.erase(at)) {
      EXPECT_TRUE(sender_.Acknowledge(at->second).ok());
    }
    ++now_;
    return written;
  }

  // The client's newest state of each body, as a user of ReceivedSnapshot would keep it.
  struct Seen {
    BodyRecord record;
    Tick tick;
  };
  const std::map<BodyId, Seen>& seen() const { return seen_; }
  const Truth& TruthAt(Tick tick) { return truth_.at(tick); }
  Tick tick() const { return tick_; }
  const std::multiset<std::pair<BodyId, Epoch>>& departures() const { return departures_; }
  std::size_t refused() const { return refused_; }
  void SetNetwork(const Network& network) { network_ = network; }
  SnapshotReceiver& receiver() { return receiver_; }
  SnapshotSender& sender() { return sender_; }

 private:
  using Mail = std::multimap<int, Bytes>;

  double Uniform() { return std::uniform_real_distribution<double>(0, 1)(random_); }
  void Post(const Bytes& bytes, Mail& mail) {
    const int copies = Uniform() < network_.loss ? 0 : (Uniform() < network_.duplicate ? 2 : 1);
    for (int i = 0; i < copies; ++i) {
      mail.emplace(now_ + static_cast<int>(Uniform() * (network_.max_delay + 1)), bytes);
    }
  }

  void Deliver() {
    for (auto at = down_.begin(); at != down_.end() && at->first <= now_; at = down_.erase(at)) {
      const auto got = receiver_.Read(at->second);
      if (!got.ok()) {
        EXPECT_NE(got.status().code(), absl::StatusCode::kInvalidArgument) << got.status();
        refused_ += absl::IsAlreadyExists(got.status()) ? 0 : 1;
        continue;
      }
      EXPECT_EQ(got->last_input, 7u);
      EXPECT_EQ(got->input_margin_ticks, -3);
      for (const BodyRecord& body : got->bodies) Adopt(got->tick, body);
      for (const DepartureRecord& departure : got->departures) {
        departures_.insert({departure.id, departure.epoch});
        const auto found = seen_.find(departure.id);
        if (found != seen_.end() && found->second.record.epoch <= departure.epoch) seen_.erase(found);
      }
    }
  }

  // Whatever arrives, however late, is what the region had at that tick, to the bit.
  void Adopt(Tick tick, const BodyRecord& body) {
    const Truth& truth = truth_.at(tick);
    const auto was = truth.find(body.id);
    ASSERT_NE(was, truth.end()) << "body " << body.id << " was not there at tick " << tick;
    ASSERT_EQ(was->second.state, body.state) << "body " << body.id << " at tick " << tick;
    ASSERT_EQ(was->second.epoch, body.epoch);
    Seen& seen = seen_[body.id];
    if (body.epoch > seen.record.epoch || tick > seen.tick) seen = {body, tick};
  }

  Network network_;
  std::mt19937 random_;
  Quantizer quantizer_;
  SnapshotHistory history_;
  SnapshotSender sender_;
  SnapshotReceiver receiver_;
  Tick tick_;
  int now_ = 0;
  Mail down_, up_;
  std::map<Tick, Truth> truth_;
  std::map<BodyId, Seen> seen_;
  std::multiset<std::pair<BodyId, Epoch>> departures_;
  std::size_t refused_ = 0;
};

inline void ExpectSeesAll(SnapshotLink& link, Tick at_least) {
  const Truth& truth = link.TruthAt(link.tick());
  EXPECT_EQ(link.seen().size(), truth.size());
  for (const auto& [id, seen] : link.seen()) {
    ASSERT_TRUE(truth.contains(id)) << "body " << id;
    if (seen.record.state == truth.at(id).state) continue;  // at rest since
    EXPECT_GE(seen.tick, at_least) << "body " << id;
  }
}

}  // namespace tessera::replication
