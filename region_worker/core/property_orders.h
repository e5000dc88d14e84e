// PropertyOrders: changes of properties that all regions of an instance are ordered to make, and what becomes of them
// here.
//
// Whoever owns the body makes the change; who gave the order repeats it to all until one answers. So a change is lost
// neither when its body is just being handed over nor when the owner dies before its standby has heard of it, and the
// changes' numbers (region.h) keep it from being made twice.
//
//   orders.Set(order.properties);          // each time that the list is another
//   orders.Apply(region);                  // before each step
//   report(orders.Answers(region, standby));
//
// Thread rule: one thread at a time.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "core/region/region.h"

namespace tessera::worker {

struct PropertyOrder {
  std::uint64_t number = 0;
  BodyId body;  // kInstanceBody: the world
  std::string name;
  PropertyValue value;
};

struct PropertyAnswer {
  std::uint64_t number = 0;
  std::string refused{};  // why; empty: it is made, and safe
  friend bool operator==(const PropertyAnswer&, const PropertyAnswer&) = default;
};

class PropertyOrders {
 public:
  // The whole list, ascending by number.
  void Set(std::vector<PropertyOrder> orders);
  // Makes those that concern bodies that are owned here.
  void Apply(region::Region& region);
  // Answers to orders of the list that are refused for good, or made on a body that is owned here and, where the region
  // has a standby, known to that.
  std::vector<PropertyAnswer> Answers(const region::Region& region, bool has_standby) const;

 private:
  std::vector<PropertyOrder> orders_;
  std::map<std::uint64_t, Tick> made_;  // by number: the tick whose log has it
  std::map<std::uint64_t, std::string> refused_;
};

}  // namespace tessera::worker
