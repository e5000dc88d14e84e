// So many connections are served, and so many of one address, and who finds no room is refused in words.
#include "gateway/connection_room.h"

#include <gmock/gmock.h>

#include <array>
#include <chrono>
#include <optional>
#include <string>

#include "gateway/testing/kept_connection.h"
#include "gateway/testing/page_request.h"
#include "gateway/testing/viewer_socket.h"
#include "gateway/testing/web_loop.h"

namespace tessera::gateway {
namespace {

using testing::HasSubstr;
using Verdict = ConnectionRoom::Verdict;

TEST(ConnectionRoomTest, ServesSoManyAndTheNextOnceOneHasGone) {
  const std::array<char, 4> connections{};
  ConnectionRoom room(2, 0);
  for (const char& connection : connections) room.Opened(&connection, "10.0.0.7");
  EXPECT_EQ(room.Of(&connections[1]), Verdict::kServed);
  EXPECT_EQ(room.Of(&connections[2]), Verdict::kFull);
  EXPECT_EQ(room.size(), 4u);
  room.Closed(&connections[2]);
  room.Opened(&connections[2], "10.0.0.7");
  EXPECT_EQ(room.Of(&connections[2]), Verdict::kFull) << "who was refused held no place";
  room.Closed(&connections[0]);
  EXPECT_EQ(room.Of(&connections[3]), Verdict::kFull) << "it keeps its verdict";
  room.Closed(&connections[3]);
  room.Opened(&connections[3], "10.0.0.7");
  EXPECT_EQ(room.Of(&connections[3]), Verdict::kServed);
}

TEST(ConnectionRoomTest, OneAddressLeavesRoomForOthers) {
  const std::array<char, 4> connections{};
  ConnectionRoom room(3, 2);
  room.Opened(&connections[0], "10.0.0.7");
  room.Opened(&connections[1], "10.0.0.7");
  room.Opened(&connections[1], "10.0.0.7");  // a second request of it
  room.Opened(&connections[2], "10.0.0.7");
  room.Opened(&connections[3], "10.0.0.8");
  EXPECT_EQ(room.Of(&connections[1]), Verdict::kServed);
  EXPECT_EQ(room.Of(&connections[2]), Verdict::kAddressFull);
  EXPECT_EQ(room.Of(&connections[3]), Verdict::kServed);
  for (const char& connection : connections) room.Closed(&connection);
  room.Closed(&connections[0]);  // one that is not known
  EXPECT_EQ(room.size(), 0u);
  room.Opened(&connections[2], "10.0.0.7");
  EXPECT_EQ(room.Of(&connections[2]), Verdict::kServed);
}

TEST(ConnectionRoomTest, BeyondThoseThatAreRefusedInWordsNobodyIsLetIn) {
  ConnectionRoom room(1, 0);
  std::array<char, 1 + kMaxRefusedConnections> connections{};
  for (const char& connection : connections) {
    EXPECT_TRUE(room.MayOpen());
    room.Opened(&connection, "10.0.0.7");
  }
  EXPECT_FALSE(room.MayOpen());
  room.Closed(&connections.back());
  EXPECT_TRUE(room.MayOpen());
}

// Somebody holds a connection; what those after it are told.
void ExpectRefused(const WebOptions& options, int status, const std::string& words) {
  WebLoop loop(options);
  std::optional<KeptConnection> holds;
  holds.emplace(loop.address());
  holds->Ask("GET", "/healthz");
  ASSERT_THAT(holds->Head(), HasSubstr("200"));
  const PageAnswer refused = RequestPage(loop.address(), "/healthz");
  EXPECT_EQ(refused.status, status);
  EXPECT_THAT(refused.body, HasSubstr(words));
  ViewerSocket second(loop.address(), "inst-1");
  EXPECT_TRUE(second.Until([&] { return second.http_status != 0; }, std::chrono::seconds(60)));
  EXPECT_EQ(second.http_status, status) << "a viewer is refused in the same words";
  holds.reset();
  // The server hears of the end in its own time.
  int then = 0;
  for (int i = 0; i < 10'000 && then != 200; ++i) then = RequestPage(loop.address(), "/healthz").status;
  EXPECT_EQ(then, 200);
  const GatewayMetrics& metrics = loop.metrics;
  EXPECT_GE(metrics.refused_full.Value() + metrics.refused_address.Value(), 2);
  EXPECT_EQ(metrics.refused_address.Value() > 0, status == 429);
}

TEST(ConnectionRoomTest, WhoFindsNoRoomIsToldSoOverTheWireAndCounted) {
  ExpectRefused({.listen = {"127.0.0.1", 0}, .page = "", .visuals = "", .allow_origins = {}, .max_connections = 1}, 503,
                "--max-connections");
  ExpectRefused({.listen = {"127.0.0.1", 0},
                 .page = "",
                 .visuals = "",
                 .allow_origins = {},
                 .max_connections = 8,
                 .max_address_connections = 1},
                429, "--max-connections-per-address");
}

}  // namespace
}  // namespace tessera::gateway
