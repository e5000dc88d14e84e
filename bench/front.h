// Front: what an engine's settings offer, as error against CPU time, and who is ahead.
//
//   front_dominated = Dominates(FrontOf(ours), FrontOf(theirs))
//
// Pure functions, any thread.
#pragma once

#include <vector>

namespace tessera::bench {

struct Offer {
  double error = 0, cpu_us = 0;
};

// The offers that no other beats or equals in both, by falling error and rising CPU time. Those whose error is not
// finite, or above `worst`, offer nothing; below `floor`, where rounding decides, all are equally good. An error that
// is less by under a hundredth of itself is no better: nobody would pay for it.
std::vector<Offer> FrontOf(std::vector<Offer> offers, double floor, double worst);

// Whether at every error that both fronts reach, `ours` takes less CPU time. The errors looked at are those of the
// corners of both: between corners nothing changes. Whoever reaches nothing at all is behind.
bool Dominates(const std::vector<Offer>& ours, const std::vector<Offer>& theirs);

}  // namespace tessera::bench
