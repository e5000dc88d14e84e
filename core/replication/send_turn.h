// SendTurn: when a body that a client may not have as it is gets looked at: at each snapshot, or as often as bodies at
// its distance are sent. Half a crowd is far from each client, and its turn comes seldom; until then nothing but this
// byte is read. A body that changes cells is looked at again at the next snapshot, so none comes near without being
// seen.
//
//   const SendTurn::Table has_come(history.pushes, thinning);       // at each snapshot
//   if (has_come[turn]) turn = SendTurn(viewer.RingAt(distance_squared), slot);
//
// Thread rule: a value.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/replication/snapshot_history_impl.h"
#include "core/replication/viewer.h"

namespace tessera::replication {

class SendTurn {
 public:
  constexpr SendTurn() = default;  // at each snapshot
  SendTurn(Viewer::Ring ring, SlotIndex slot)
      : value_(static_cast<std::uint8_t>((static_cast<unsigned>(ring) + 1) * Viewer::kMaxPeriod +
                                         slot % Viewer::kMaxPeriod)) {}

  // Whether a period's turn has come: for all clients at the same snapshots, so that one record serves them.
  static bool HasCome(std::uint64_t pushes, SlotIndex slot, std::uint32_t period) {
    return ((pushes + slot) & (period - 1)) == 0;
  }

  // All turns that have come at a snapshot.
  class Table {
   public:
    Table(std::uint64_t pushes, std::uint32_t thinning) {
      for (SlotIndex phase = 0; phase < Viewer::kMaxPeriod; ++phase) {
        come_[phase] = 1;
        for (const Viewer::Ring ring : {Viewer::Ring::kNear, Viewer::Ring::kMiddle, Viewer::Ring::kFar}) {
          come_[SendTurn(ring, phase).value_] = HasCome(pushes, phase, Viewer::Period(ring, thinning)) ? 1 : 0;
        }
      }
    }
    std::uint8_t operator[](SendTurn turn) const { return come_[turn.value_]; }  // 1 or 0

   private:
    std::array<std::uint8_t, 4 * std::size_t{Viewer::kMaxPeriod}> come_{};
  };

 private:
  std::uint8_t value_ = 0;
};

}  // namespace tessera::replication
