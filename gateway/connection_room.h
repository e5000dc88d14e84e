// ConnectionRoom: who of those that connect is served: so many at once, and so many of one address.
//
// A connection that finds no room is refused in words, by the answer to its first request, for which a few more may be
// open for a moment. Beyond those nobody is let in at all, so that whoever opens more than all that costs nothing.
//
//   if (!room.MayOpen()) hang up;
//   room.Opened(connection, "10.0.0.7");
//   switch (room.Of(connection)) ...
//   room.Closed(connection);
//
// Thread rule: one thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <unordered_map>

namespace tessera::gateway {

// Connections that wait to be refused. Each is gone with its first request, or after 10 s without one.
inline constexpr std::size_t kMaxRefusedConnections = 64;

class ConnectionRoom {
 public:
  // `most_of_address` 0: as many as `most`.
  ConnectionRoom(std::size_t most, std::size_t most_of_address)
      : most_(most), most_of_address_(most_of_address == 0 ? most : most_of_address) {}

  enum class Verdict : std::uint8_t { kServed, kFull, kAddressFull };

  bool MayOpen() const { return connections_.size() < most_ + kMaxRefusedConnections; }
  // Judges it for as long as it is open. One that is known keeps its verdict.
  void Opened(const void* connection, const std::string& address);
  // Does nothing for one that is not known.
  void Closed(const void* connection);
  // kFull for one that is not known.
  Verdict Of(const void* connection) const;
  std::size_t size() const { return connections_.size(); }

 private:
  struct Connection {
    std::string address;
    Verdict verdict = Verdict::kServed;
  };

  std::size_t most_, most_of_address_;
  std::size_t served_ = 0;
  std::unordered_map<const void*, Connection> connections_;
  std::map<std::string, std::size_t> served_of_address_;  // only of those that have some
};

}  // namespace tessera::gateway
