// InputSequence: the numbers of one player's inputs that were decided on here, so that each input counts once.
//
// It knows the newest number and which of the kWindow - 1 numbers below it were decided on; still older ones pass for
// repeated. Thread rule: one thread at a time.
#pragma once

#include <cstdint>

namespace tessera::region {

class InputSequence {
 public:
  static constexpr std::uint32_t kWindow = 64;

  enum class Order : std::uint8_t {
    kNewest,    // above all numbers before it
    kLate,      // not decided on yet, but a higher number was
    kRepeated,  // decided on before, or too old to know
  };

  // Decides on `number`, and says how it stood to those before it.
  Order Decide(std::uint32_t number) {
    if (number > newest_) {
      const std::uint32_t step = number - newest_;
      decided_ = (step < kWindow ? decided_ << step : 0) | 1;
      newest_ = number;
      return Order::kNewest;
    }
    const std::uint32_t back = newest_ - number;
    const std::uint64_t bit = back < kWindow ? std::uint64_t{1} << back : 0;
    if (bit == 0 || (decided_ & bit) != 0) return Order::kRepeated;
    decided_ |= bit;
    return Order::kLate;
  }

 private:
  std::uint32_t newest_ = 0;
  std::uint64_t decided_ = 1;  // bit i stands for newest_ - i; 0 is no input's number
};

}  // namespace tessera::region
