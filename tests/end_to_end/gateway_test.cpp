// The gateway with real processes: what a page would see, and what it does to nobody else.
#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "gateway/testing/page_request.h"
#include "gateway/testing/viewer_socket.h"
#include "host/files.h"
#include "telemetry/http_get.h"
#include "tests/end_to_end/gateway_fixture.h"
#include "tests/support/sanitizer_options.h"

namespace tessera::end_to_end {
namespace {

using namespace std::chrono_literals;
using gateway::ViewerSocket;
using nlohmann::json;
using testing::HasSubstr;

#if defined(__SANITIZE_THREAD__)
constexpr double kResidentPerByte = 5;  // ThreadSanitizer keeps four bytes and a half about each that was used
#else
constexpr double kResidentPerByte = 1;
#endif

TEST_F(GatewayTest, AViewerSeesTheWorldAsItMoves) {
  ASSERT_NO_FATAL_FAILURE(StartWorld());
  const auto viewer = Watch();
  ASSERT_TRUE(Until({viewer.get()}, "all bodies", [&] { return SeesAll(*viewer); }));
  EXPECT_EQ(viewer->http_status, 101);
  EXPECT_EQ(viewer->decoder.instance, run_->instance_id());
  EXPECT_EQ(viewer->decoder.own_body, 0u);
  EXPECT_GT(viewer->decoder.shapes, 2u);
  EXPECT_GT(viewer->decoder.statics, 0u);
  ASSERT_TRUE(Until({viewer.get()}, "the map with its hosts, and all regions heard", [&] {
    return viewer->decoder.hosts.size() == 4 && !viewer->decoder.hosts[0].empty() && RegionsAlive(*viewer) == 4;
  }));
  ASSERT_TRUE(Until({viewer.get()}, "what snapshots and prediction cost each region", [&] {
    return std::ranges::all_of(viewer->newest["status"].at("regions"), [](const json& region) {
      return region.value("broadcast_ms", 0.0) > 0 && region.contains("prediction_ms");
    });
  }));

  const std::size_t before = viewer->decoder.frames;
  const auto then = viewer->decoder.bodies;
  ASSERT_TRUE(Until({viewer.get()}, "frames", [&] { return viewer->decoder.frames > before + 60; }));
  int moved = 0;
  for (const auto& [id, body] : viewer->decoder.bodies) {
    moved += then.contains(id) && then.at(id).position != body.position ? 1 : 0;
  }
  EXPECT_GT(moved, 20);
  // It is the world that players see, a moment earlier or later, once neither waits for a processor.
  ASSERT_TRUE(Until({viewer.get()}, "bodies where players see them", [&] {
    int near = 0;
    for (const auto& [id, seen] : run_->bots()[0]->client().World()) {
      const auto body = viewer->decoder.bodies.find(id.value());
      if (body == viewer->decoder.bodies.end()) continue;
      near += Length(body->second.Metres() - seen.state.position) < 5 ? 1 : 0;
    }
    return near >= static_cast<int>(kBodies);
  }));
  for (const auto& [id, seen] : run_->bots()[0]->client().World()) {
    const auto body = viewer->decoder.bodies.find(id.value());
    if (body != viewer->decoder.bodies.end() && IsPlayerBody(id)) {
      EXPECT_THAT(body->second.name, HasSubstr("bot-"));
    }
  }

  EXPECT_EQ(run_->Latest().players(), kBots) << "a viewer is no player";
  const auto worlds = telemetry::HttpGet(address(), "/api/worlds");
  ASSERT_TRUE(worlds.ok()) << worlds.status();
  EXPECT_EQ(json::parse(worlds->body).at("worlds").at(0).at("instance"), run_->instance_id());
  EXPECT_EQ(telemetry::HttpGet(address(), "/healthz")->status, 200);
}

// The page of this repository, as the program sends it to a browser. It needs no cluster.
TEST(GatewayPageTest, IsSmallOverTheWire) {
  FurtherGateway gateway("unix:/nowhere/control.sock", {"--page", TESSERA_SOURCE_DIR "/web/dist"});
  std::size_t wire_bytes = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(TESSERA_SOURCE_DIR "/web/dist")) {
    if (!entry.is_regular_file()) continue;
    const std::string path = "/" + entry.path().lexically_relative(TESSERA_SOURCE_DIR "/web/dist").string();
    gateway::PageAnswer answer =
        gateway::RequestPage(gateway.address, path, {"Accept-Encoding: gzip, deflate, br, zstd"});
    ASSERT_EQ(answer.status, 200) << path;
    EXPECT_EQ(answer.headers["content-encoding"], "gzip") << path;
    EXPECT_TRUE(gateway::Gunzip(answer.body) == host::ReadFile(entry.path().string(), 10'000'000).value_or("?"))
        << path;
    wire_bytes += answer.body.size();
  }
  RecordProperty("page_bytes", std::to_string(wire_bytes));
  EXPECT_GT(wire_bytes, 100'000u);
  EXPECT_LE(wire_bytes, 400'000u);
  EXPECT_TRUE(gateway.End().Clean());
}

TEST_F(GatewayTest, APlayerJoinsSteersIsSeenAndLeaves) {
  ASSERT_NO_FATAL_FAILURE(StartWorld(2));
  const auto player = Watch(), other = Watch();
  ASSERT_TRUE(Until({player.get(), other.get()}, "all bodies", [&] { return SeesAll(*player) && SeesAll(*other); }));
  player->Send({{"type", "join"}, {"name", "ada"}});
  ASSERT_TRUE(
      Until({player.get(), other.get()}, "a welcome of its own", [&] { return player->decoder.own_body != 0; }));
  const std::uint64_t own = player->decoder.own_body;
  ASSERT_TRUE(Until({player.get(), other.get()}, "its body is seen by both", [&] {
    return player->decoder.bodies.contains(own) && other->decoder.bodies.contains(own) &&
           other->decoder.bodies.at(own).name == "ada";
  }));
  const Vec3d from = other->decoder.bodies.at(own).Metres();
  player->Send({{"type", "steer"}, {"force", {500, 0, 0}}, {"move", {1, 0}}});
  ASSERT_TRUE(Until({player.get(), other.get()}, "it moves",
                    [&] { return Length(other->decoder.bodies.at(own).Metres() - from) > 1; }));
  EXPECT_EQ(run_->Latest().players(), kBots + 1);
  player->Send({{"type", "leave"}});
  ASSERT_TRUE(Until({player.get(), other.get()}, "its body is gone, and it watches",
                    [&] { return !other->decoder.bodies.contains(own) && player->decoder.own_body == 0; }));
}

TEST_F(GatewayTest, AKilledWorkerIsSeenToBeReplaced) {
  ASSERT_NO_FATAL_FAILURE(StartWorld());
  ASSERT_TRUE(PlayUntilProtected());
  const auto viewer = Watch();
  ASSERT_TRUE(Until({viewer.get()}, "all regions", [&] { return SeesAll(*viewer) && RegionsAlive(*viewer) == 4; }));
  ASSERT_NO_FATAL_FAILURE(ShowKey(*viewer));
  viewer->Send({{"type", "order"}, {"number", 9}, {"order", "end_worker"}, {"region", 2}});
  ASSERT_TRUE(Until({viewer.get()}, "the answer", [&] { return viewer->newest.contains("answer"); }));
  EXPECT_EQ(viewer->newest["answer"]["number"], 9);
  EXPECT_EQ(viewer->newest["answer"]["ok"], true) << viewer->newest["answer"];
  const std::uint64_t map = viewer->decoder.map_version;
  ASSERT_TRUE(Until({viewer.get()}, "a failover", [&] {
    const json& status = viewer->newest["status"];
    return status.at("failovers") == 1 && viewer->decoder.map_version > map;
  }));
  ASSERT_TRUE(Until({viewer.get()}, "four regions again", [&] { return RegionsAlive(*viewer) == 4; }));
  EXPECT_TRUE(Until({viewer.get()}, "all bodies", [&] { return SeesAll(*viewer); }));
  EXPECT_GT(viewer->texts["events"], 0);
  // Viewers see what an operator sets.
  viewer->Send({{"type", "order"}, {"number", 10}, {"order", "pause"}});
  ASSERT_TRUE(Until({viewer.get()}, "it stands", [&] { return viewer->decoder.paused; }));
}

TEST_F(GatewayTest, WhatIsNotThereIsAProblemAndAWorldThatEndsToo) {
  ASSERT_NO_FATAL_FAILURE(StartWorld(1));
  ViewerSocket lost(address(), "inst-99"), nowhere(address(), "", {.path = "/elsewhere"});
  const auto viewer = Watch();
  ASSERT_TRUE(Until({&lost, &nowhere, viewer.get()}, "the ends",
                    [&] { return lost.closed && (nowhere.closed || nowhere.http_status != 0) && SeesAll(*viewer); }));
  EXPECT_EQ(lost.closed, "4000 no_world");
  EXPECT_THAT(lost.newest["problem"]["text"].get<std::string>(), HasSubstr("inst-99"));
  EXPECT_EQ(nowhere.http_status, 404);
  ASSERT_EQ(Tessera({"instance", "delete", run_->instance_id()}).exit_code, 0);
  ASSERT_TRUE(viewer->Until([&] { return viewer->closed.has_value(); }, kPatience));
  EXPECT_EQ(viewer->closed, "4000 ended");
  // Two gateways, one without a control plane.
  FurtherGateway alone("unix:/nowhere/control.sock", {});
  ViewerSocket waiting(alone.address, "inst-1");
  ASSERT_TRUE(waiting.Until([&] { return waiting.closed.has_value(); }, kPatience));
  EXPECT_EQ(waiting.closed, "4000 no_control_plane");
  EXPECT_GT(waiting.newest["problem"]["again_s"], 0);
  EXPECT_TRUE(alone.End().Clean());
}

TEST_F(GatewayTest, WhoSendsNonsenseHarmsNobodyElse) {
  ASSERT_NO_FATAL_FAILURE(StartWorld(1));
  const auto good = Watch(), vague = Watch(), large = Watch(), loud = Watch(), binary = Watch(), broken = Watch();
  ViewerSocket stranger(address(), run_->instance_id(), {.origin = "http://evil.example"});
  ViewerSocket rebound(address(), run_->instance_id(), {.origin = "http://evil.example", .host = "evil.example"});
  const auto all = {good.get(), vague.get(), large.get(), loud.get(), binary.get(), broken.get(), &stranger, &rebound};
  ASSERT_TRUE(Until(all, "all are in", [&] {
    return std::ranges::all_of(all, [](const ViewerSocket* v) { return v->http_status != 0 || v->closed; });
  }));
  EXPECT_EQ(stranger.http_status, 403);
  EXPECT_EQ(rebound.http_status, 403);
  for (int i = 0; i < 10; ++i) vague->SendFrame(ViewerSocket::kText, "{\"type\":");
  large->SendFrame(ViewerSocket::kText, std::string(5000, ' '));
  large->SendFrame(ViewerSocket::kText, std::string(1 << 20, 'x'));
  binary->SendFrame(ViewerSocket::kBinary, std::string(10, '\0'));
  for (int i = 0; i < 2000; ++i) loud->Send({{"type", "steer"}});
  broken->SendBytes(std::string(1000, '\xff'));
  ASSERT_TRUE(Until(all, "they are told", [&] {
    return vague->closed && loud->closed && broken->closed && large->texts["problem"] == 2 &&
           binary->texts["problem"] == 1;
  }));
  EXPECT_EQ(vague->closed, "4000 bad_message");
  EXPECT_EQ(loud->closed, "4000 bad_message");
  EXPECT_THAT(large->newest["problem"]["text"].get<std::string>(), HasSubstr("longer than 4096 bytes"));
  const std::size_t frames = good->decoder.frames;
  EXPECT_TRUE(Until({good.get()}, "the others go on", [&] { return good->decoder.frames > frames + 30; }));
  FurtherGateway strict(run_->cluster().control_address(), {"--max-viewers", "1"});
  ViewerSocket first(strict.address, run_->instance_id()), second(strict.address, run_->instance_id());
  ASSERT_TRUE(Until({&first, &second}, "one is too many", [&] { return second.closed && first.decoder.frames > 0; }));
  EXPECT_EQ(second.closed, "4000 too_many_viewers");
  first.Send({{"type", "order"}, {"number", 1}, {"order", "scale"}, {"regions", 2}});
  ASSERT_TRUE(Until({&first}, "the answer", [&] { return first.newest.contains("answer"); }));
  EXPECT_EQ(first.newest["answer"]["ok"], false);
  EXPECT_THAT(first.newest["answer"]["text"].get<std::string>(), HasSubstr("not_allowed"));
  EXPECT_THAT(first.newest["answer"]["text"].get<std::string>(), HasSubstr("--key-file"));
  EXPECT_TRUE(strict.End().Clean());
}

TEST_F(GatewayTest, ALocalOrderNeedsTheKeyInThePagesAddress) {
  ASSERT_NO_FATAL_FAILURE(StartWorld(1));
  const std::string key = run_->cluster().page_key();
  EXPECT_EQ(run_->cluster().page_url(), "http://" + address() + "/#key=" + key);
  const auto owner = Watch(), stranger = Watch();
  ASSERT_TRUE(
      Until({owner.get(), stranger.get()}, "all bodies", [&] { return SeesAll(*owner) && SeesAll(*stranger); }));
  const json pause = {{"type", "order"}, {"number", 7}, {"order", "pause"}};
  stranger->Send(pause);
  ASSERT_TRUE(Until({stranger.get()}, "the answer", [&] { return stranger->newest.contains("answer"); }));
  EXPECT_EQ(stranger->newest["answer"]["ok"], false);
  EXPECT_EQ(stranger->newest["answer"]["needs"], "key");
  // Nor does a token help, or a key that was guessed: at the socket nobody would check the one.
  for (const auto& [name, shown] : {std::pair("token", "tsa_" + std::string(64, '0')), {"key", std::string(64, '0')}}) {
    stranger->newest.erase("answer");
    stranger->Send({{"type", "authorize"}, {"number", 8}, {name, shown}});
    ASSERT_TRUE(Until({stranger.get()}, "the answer", [&] { return stranger->newest.contains("answer"); }));
    EXPECT_EQ(stranger->newest["answer"]["ok"], false) << name;
  }
  ASSERT_NO_FATAL_FAILURE(ShowKey(*owner));
  stranger->newest.erase("answer");
  stranger->Send(pause);
  ASSERT_TRUE(Until({stranger.get()}, "the answer", [&] { return stranger->newest.contains("answer"); }));
  EXPECT_EQ(stranger->newest["answer"]["ok"], false) << "another's key is not his";
  EXPECT_FALSE(stranger->decoder.paused);
  owner->Send(pause);
  ASSERT_TRUE(Until({owner.get()}, "it stands", [&] { return owner->decoder.paused; }));
  EXPECT_EQ(owner->newest["answer"]["ok"], true) << owner->newest["answer"];
  EXPECT_THAT(host::ReadFile(run_->cluster().log_dir() + "/gateway.log", 1 << 20).value_or(key),
              testing::Not(HasSubstr(key)));
  // Beyond this machine the key would be for everybody to read.
  const support::RunResult open = support::RunProgram(
      "tessera-gateway", {"--control", run_->cluster().control_address(), "--listen", "0.0.0.0:0", "--key-file", "/x"});
  EXPECT_EQ(open.exit_code, 1);
  EXPECT_THAT(open.err, HasSubstr("only with --listen at loopback"));
}

TEST_F(GatewayTest, WhoDoesNotReadCostsNoMemoryAndGetsTheNewestLater) {
  ASSERT_NO_FATAL_FAILURE(StartWorld(1));
  support::AddSanitizerOption("ASAN_OPTIONS", "quarantine_size_mb=1");  // it would keep what was given back
  FurtherGateway gateway(run_->cluster().control_address(), {});
  ViewerSocket reader(gateway.address, run_->instance_id());
  ASSERT_TRUE(Until({&reader}, "all bodies", [&] { return SeesAll(reader); }));
  std::vector<std::unique_ptr<ViewerSocket>> slow;
  slow.reserve(20);
  for (int i = 0; i < 20; ++i) {
    slow.push_back(std::make_unique<ViewerSocket>(gateway.address, run_->instance_id(),
                                                  ViewerSocket::Options{.receive_buffer_bytes = 4096}));
  }
  const auto read_on = [&](std::size_t frames) {
    const std::size_t before = reader.decoder.frames;
    return Until({&reader}, "frames", [&, before] { return reader.decoder.frames >= before + frames; });
  };
  ASSERT_TRUE(read_on(150));
  const double before = ResidentBytes(gateway.metrics);
  const std::size_t frames_before = reader.decoder.frames;
  ASSERT_GT(before, 1e6);
  ASSERT_TRUE(read_on(300));
  EXPECT_LT(ResidentBytes(gateway.metrics) - before, 4e6 * kResidentPerByte) << "300 frames to 20 who do not read";
  ASSERT_TRUE(Until({&reader, slow[0].get()}, "it is up to date",
                    [&] { return SeesAll(*slow[0]) && slow[0]->decoder.tick + 30 > reader.decoder.tick; }));
  EXPECT_LT(slow[0]->decoder.frames, reader.decoder.frames - frames_before) << "it was spared those in between";
}

}  // namespace
}  // namespace tessera::end_to_end
