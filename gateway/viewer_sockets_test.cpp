// The WebSockets of viewers, over the wire: who is let in, what they are sent, and what becomes of bad messages. The
// world is a recording, so there is no cluster.
#include "gateway/viewer_sockets.h"

#include <gmock/gmock.h>

#include <optional>
#include <string>

#include "client_sdk/recorder.h"
#include "core/world/byte_view.h"
#include "core/world/packed_scene.h"
#include "core/world/partition_map.h"
#include "core/world/scene_load.h"
#include "core/world/sha256.h"
#include "gateway/testing/page_request.h"
#include "gateway/testing/viewer_socket.h"
#include "gateway/testing/web_loop.h"
#include "host/temporary_folder.h"

namespace tessera::gateway {
namespace {

using namespace std::chrono_literals;
using testing::StartsWith;

constexpr auto kPatience = 60s;

// A ball that lies in the middle for some seconds. `more`: fields of the scene.
void WriteRecording(const std::string& path, const std::string& more = "") {
  const auto loaded = LoadScene(SceneForm::kText, more + R"(
    name: "plaza" bounds { min { x: -50 y: -5 z: -50 } max { x: 50 y: 50 z: 50 } }
    bodies { id: 1 motion: MOTION_STATIC shape { plane { normal { y: 1 } } } }
    bodies { id: 2 mass: 1 shape { sphere { radius: 0.5 } } })",
                                "plaza.textproto");
  ASSERT_TRUE(loaded.ok()) << loaded.status();
  const client::RecordingHeader header{.instance_id = "plaza-1",
                                       .player = PlayerNumber(1),
                                       .tick_rate_hz = 60,
                                       .snapshot_rate_hz = 30,
                                       .started = true,
                                       .map = client::WrittenMap(*MakeGridMap(loaded->scene->ground(), 1)),
                                       .scene = std::string(AsText(PackScene(*loaded->scene)))};
  auto writer = client::RecordingWriter::Create(path, header, 10'000'000);
  ASSERT_TRUE(writer.ok()) << writer.status();
  client::Recorder recorder(*std::move(writer), *loaded->scene, header);
  for (int step = 0; step < 300; ++step) {
    const client::TimePoint at = client::TimePoint{1h} + step * 33'333us;
    if (step == 0) recorder.Region(at, RegionId(1), client::RegionEntry::Change::kBegins);
    replication::ReceivedSnapshot snapshot;
    snapshot.tick = Tick(static_cast<std::uint64_t>(2 * step + 2));
    BodyState state;
    state.position = {0.01 * step, 0.5, 0};
    snapshot.bodies.push_back({BodyId(2), Epoch(1), state});
    recorder.Snapshot(at, RegionId(1), snapshot);
    ASSERT_TRUE(recorder.Flush(at).ok());
  }
  ASSERT_TRUE(recorder.Close().ok());
}

class ViewerSocketsTest : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_NO_FATAL_FAILURE(WriteRecording(folder_.path() + "/match.rec"));
    GatewayOptions options;
    options.control.address = "unix:" + folder_.path() + "/nobody.sock";
    options.recordings_dir = folder_.path();
    options.max_players = 1;
    loop_.emplace(WebOptions{.listen = {"127.0.0.1", 0}, .page = {}, .visuals = {}, .allow_origins = {}}, options);
  }
  ViewerSocket::Options At(const std::string& path) {
    ViewerSocket::Options options;
    options.path = path;
    return options;
  }
  const std::string& address() const { return loop_->address(); }

  const host::TemporaryFolder folder_;
  std::optional<WebLoop> loop_;
};

TEST_F(ViewerSocketsTest, AViewerIsSentTheWorldUntilItGoes) {
  std::optional<ViewerSocket> viewer;
  viewer.emplace(address(), "", At("/play/match.rec"));
  EXPECT_TRUE(viewer->Until([&] { return viewer->decoder.bodies.size() == 1; }, kPatience));
  EXPECT_EQ(viewer->http_status, 101);
  EXPECT_EQ(loop_->metrics.viewers.Value(), 1);
  // The only place is taken until the first one is gone.
  ViewerSocket second(address(), "", At("/play/match.rec"));
  EXPECT_TRUE(second.Until([&] { return second.closed.has_value(); }, kPatience));
  EXPECT_EQ(second.closed.value_or(""), "4000 full");
  viewer.reset();
  bool shown = false;
  const auto limit = std::chrono::steady_clock::now() + kPatience;
  while (!shown && std::chrono::steady_clock::now() < limit) {
    ViewerSocket third(address(), "", At("/play/match.rec"));
    shown = third.Until([&] { return third.decoder.bodies.size() == 1; }, kPatience);
  }
  EXPECT_TRUE(shown);
}

// A square kilometre below the ball.
std::string WideGround() {
  std::string text =
      "bodies { id: 9 motion: MOTION_STATIC shape { height_field { columns: 1025 rows: 1025 spacing: 1 heights: [0";
  for (int i = 1; i < 1025 * 1025; ++i) text += i % 5 == 0 ? ",-1" : ",0";
  return text + "] } } }";
}

TEST_F(ViewerSocketsTest, TilesOfALargeLevelAreThereByTheirHashesWhileSomebodyWatches) {
  ASSERT_NO_FATAL_FAILURE(WriteRecording(folder_.path() + "/wide.rec", WideGround()));
  std::optional<ViewerSocket> viewer;
  viewer.emplace(address(), "", At("/play/wide.rec"));
  ASSERT_TRUE(viewer->Until([&] { return viewer->decoder.bodies.size() == 1; }, kPatience));
  EXPECT_EQ(viewer->decoder.statics, 1u) << "the plane alone";
  ASSERT_GT(viewer->decoder.tiles.size(), 8u);
  std::size_t parts = 0;
  for (const auto& [sha256, bytes] : viewer->decoder.tiles) {
    PageAnswer tile = RequestPage(address(), "/tiles/" + sha256);
    ASSERT_EQ(tile.status, 200);
    EXPECT_EQ(tile.body.size(), bytes);
    EXPECT_EQ(Sha256Hex(tile.body), sha256);
    EXPECT_THAT(tile.headers["cache-control"], testing::HasSubstr("immutable"));
    ByteReader in(AsBytes(tile.body));
    const std::size_t before = viewer->decoder.statics;
    while (in.ok() && in.remaining() > 0) viewer->decoder.Take(in.Block(tile.body.size()));
    EXPECT_TRUE(in.ok()) << in.error();
    parts += viewer->decoder.statics - before;
  }
  EXPECT_GE(parts, viewer->decoder.tiles.size());
  const std::string known = "/tiles/" + viewer->decoder.tiles[0].first;
  EXPECT_EQ(RequestPage(address(), "/tiles/" + std::string(64, '0')).status, 404);
  EXPECT_EQ(RequestPage(address(), known, {}, "HEAD").status, 200);
  viewer.reset();
  const auto limit = std::chrono::steady_clock::now() + kPatience;
  while (RequestPage(address(), known).status == 200 && std::chrono::steady_clock::now() < limit) {
  }
  EXPECT_EQ(RequestPage(address(), known).status, 404);
}

TEST_F(ViewerSocketsTest, AMessageInPartsIsOne) {
  ViewerSocket viewer(address(), "", At("/play/match.rec"));
  ASSERT_TRUE(viewer.Until([&] { return viewer.http_status == 101; }, kPatience));
  // Without the last bit a frame goes on in the next one, of kind 0.
  const std::string begin = R"({"type":"play",)", rest = R"("paused":true})";
  viewer.SendBytes(std::string("\x01", 1) + static_cast<char>(0x80 | begin.size()) + std::string(4, '\0') + begin);
  viewer.SendFrame(0, rest);
  EXPECT_TRUE(viewer.Until([&] { return viewer.newest.contains("play") && viewer.newest["play"]["paused"] == true; },
                           kPatience));
  EXPECT_EQ(viewer.texts["problem"], 0) << viewer.newest["problem"];
}

TEST_F(ViewerSocketsTest, BadMessagesAreToldAndTheTenthClosesTheViewer) {
  ViewerSocket viewer(address(), "", At("/play/match.rec"));
  ASSERT_TRUE(viewer.Until([&] { return viewer.http_status == 101; }, kPatience));
  const auto told = [&](const std::string& words) {
    return viewer.Until(
        [&] {
          const auto problem = viewer.newest.find("problem");
          return problem != viewer.newest.end() &&
                 problem->second.at("text").get<std::string>().find(words) != std::string::npos;
        },
        kPatience);
  };
  viewer.SendFrame(ViewerSocket::kBinary, "{}");
  EXPECT_TRUE(told("message: is binary; viewers send texts"));
  viewer.SendFrame(ViewerSocket::kText, std::string(3 * kMaxViewerMessage_bytes, ' '));
  EXPECT_TRUE(told("message: longer than 4096 bytes"));
  viewer.Send({{"type", "view"}});
  for (int more = 2; more < kMaxBadMessages; ++more) viewer.SendFrame(ViewerSocket::kText, "no json");
  EXPECT_TRUE(viewer.Until([&] { return viewer.closed.has_value(); }, kPatience));
  EXPECT_EQ(viewer.closed.value_or(""), "4000 bad_message");
  EXPECT_EQ(loop_->metrics.bad_messages.Value(), kMaxBadMessages);
  EXPECT_EQ(loop_->metrics.messages.Value(), 1);
}

TEST_F(ViewerSocketsTest, WhoMayNotConnectIsToldSo) {
  for (const char* path : {"/watch/", "/watch/a/b", "/play/", "/elsewhere", "/watch/%2e%2e%2fsecret"}) {
    ViewerSocket viewer(address(), "", At(path));
    EXPECT_TRUE(viewer.Until([&] { return viewer.http_status != 0; }, kPatience)) << path;
    EXPECT_EQ(viewer.http_status, 404) << path;
  }
  ViewerSocket::Options foreign = At("/play/match.rec");
  foreign.origin = "http://other.example";
  ViewerSocket stranger(address(), "", foreign);
  EXPECT_TRUE(stranger.Until([&] { return stranger.http_status != 0; }, kPatience));
  EXPECT_EQ(stranger.http_status, 403);
  EXPECT_EQ(loop_->metrics.refused_origin.Value(), 1);
  EXPECT_EQ(loop_->metrics.viewers.Value(), 0);
  ViewerSocket missing(address(), "", At("/play/none.rec"));
  EXPECT_TRUE(missing.Until([&] { return missing.closed.has_value(); }, kPatience));
  EXPECT_THAT(missing.closed.value_or(""), StartsWith("4000 "));
}

TEST(MessagePartsTest, PartsAreOneTextAndOneThatIsTooLongIsNotKept) {
  MessageParts parts(10);
  parts.Begin();
  parts.Add("12345");
  parts.Add("67890");
  EXPECT_EQ(parts.text(), "1234567890");
  EXPECT_FALSE(parts.too_long());
  parts.Add("1");
  parts.Add("2");
  EXPECT_TRUE(parts.too_long());
  EXPECT_EQ(parts.text(), "");
  parts.Begin();
  parts.Add("again");
  EXPECT_FALSE(parts.too_long());
  EXPECT_EQ(parts.text(), "again");
}

}  // namespace
}  // namespace tessera::gateway
