// BackendOrders: messages of a game's backend that all regions of an instance are ordered to take, and what becomes of
// them here; and which events for the backend are stored, so that they need not be kept any more.
//
// Whoever owns the target takes the message; who gave the order repeats it to all until one answers. So a message is
// lost neither when its target is just being handed over nor when the owner dies before its standby has heard of it,
// and the messages' numbers (core/game/mail.h) keep it from coming twice.
//
//   orders.Set(order.backend);             // each time that the order is another
//   orders.Apply(region);                  // before each step
//   report(orders.Answers(region));
//
// Thread rule: one thread at a time.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "core/region/region.h"

namespace tessera::worker {

struct BackendOrder {
  std::uint64_t number = 0;
  BodyId target;  // kInstanceBody: the world
  game::Message message;
};

struct BackendAnswer {
  std::uint64_t number = 0;
  std::string refused{};  // why; empty: it is taken, and safe
  friend bool operator==(const BackendAnswer&, const BackendAnswer&) = default;
};

struct BackendOrderList {
  std::vector<BackendOrder> messages;  // ascending by number, without an answer yet
  std::uint64_t published_up_to = 0;   // events that are stored
};

class BackendOrders {
 public:
  void Set(BackendOrderList orders);
  // Gives those that concern bodies that are owned here to their records.
  void Apply(region::Region& region);
  // Answers to messages of the list that are refused for good, or that a record here has and, where the region has a
  // standby, that knows of.
  std::vector<BackendAnswer> Answers(const region::Region& region) const;

 private:
  BackendOrderList orders_;
  std::map<std::uint64_t, Tick> taken_;  // by number: the tick whose log has it
  std::map<std::uint64_t, std::string> refused_;
};

}  // namespace tessera::worker
