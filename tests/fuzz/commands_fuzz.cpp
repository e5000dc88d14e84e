// A client's command datagram, and a player's record in a grant: refused, or they say the same when they are written
// again.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "core/game/player_record.h"
#include "core/replication/command.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tessera;
  const auto message = replication::DecodeCommands({data, size});
  if (message.ok() && replication::CommandsThatFit(message->commands) == message->commands.size()) {
    const std::vector<std::uint8_t> encoded = replication::EncodeCommands(*message);  // `again` reads from it
    const auto again = replication::DecodeCommands(encoded);
    if (!again.ok() || again->commands != message->commands) std::abort();
  }
  ByteReader in({data, size});
  const game::PlayerRecord record = game::ReadPlayerRecord(in);
  if (!in.ok() || !game::CheckPlayerRecord(record).ok()) return 0;
  ByteWriter out;
  game::Write(out, record);
  ByteReader written(out.bytes());
  if (game::ReadPlayerRecord(written) != record) std::abort();
  return 0;
}
