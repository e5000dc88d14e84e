// Recordings of whole worlds with real processes: made by a gateway, sought and played by viewers and by the command
// line.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "absl/strings/ascii.h"
#include "gateway/testing/viewer_socket.h"
#include "telemetry/http_get.h"
#include "tests/end_to_end/gateway_fixture.h"
#include "tests/support/pseudo_terminal.h"

namespace tessera::end_to_end {
namespace {

namespace fs = std::filesystem;

using namespace std::chrono_literals;
using gateway::ViewerSocket;
using nlohmann::json;
using testing::HasSubstr;

class RecordingTest : public GatewayTest {
 protected:
  json Recordings() {
    const auto page = telemetry::HttpGet(address(), "/api/recordings");
    return page.ok() ? json::parse(page->body).at("recordings") : json();
  }
  std::string Folder() { return run_->cluster().state_dir() + "/recordings"; }
  support::RunResult Record(const std::vector<std::string>& arguments) {
    std::vector<std::string> all{"record"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    all.insert(all.end(), {"--gateway", address()});
    return Tessera(all);
  }
  std::unique_ptr<ViewerSocket> Play(const std::string& file) {
    return std::make_unique<ViewerSocket>(address(), "", ViewerSocket::Options{.path = "/play/" + file});
  }
};

TEST_F(RecordingTest, ADeathIsSeenAgainWhereverOneLooks) {
  ASSERT_NO_FATAL_FAILURE(StartWorld());
  ASSERT_TRUE(PlayUntilProtected());
  // Nobody watches: the gateway joins for the recording alone.
  const auto begun = Record({"start", run_->instance_id()});
  ASSERT_EQ(begun.exit_code, 0) << begun.err;
  EXPECT_THAT(begun.out, HasSubstr(run_->instance_id() + " is recorded into " + run_->instance_id() + "-20"));
  auto viewer = Watch();
  ASSERT_TRUE(
      Until({viewer.get()}, "all regions, and word of the recording",
            [&] { return SeesAll(*viewer) && RegionsAlive(*viewer) == 4 && viewer->newest.contains("recording"); }))
      << viewer->decoder.bodies.size() << " bodies; " << viewer->newest;
  EXPECT_EQ(viewer->newest["recording"]["on"], true);
  const std::string file = viewer->newest["recording"]["file"];
  ASSERT_NO_FATAL_FAILURE(ShowKey(*viewer));
  viewer->Send({{"type", "order"}, {"number", 1}, {"order", "end_worker"}, {"region", 2}});
  ASSERT_TRUE(Until({viewer.get()}, "a failover",
                    [&] { return viewer->newest["status"].value("failovers", 0) == 1 && RegionsAlive(*viewer) == 4; }));
  const int recorded = viewer->texts["recording"];
  ASSERT_TRUE(Until({viewer.get()}, "it goes on, with all bodies",
                    [&] { return viewer->texts["recording"] > recorded + 2 && SeesAll(*viewer); }))
      << viewer->decoder.bodies.size() << " bodies; " << viewer->texts["recording"] - recorded << " words of it, "
      << viewer->newest["recording"];
  EXPECT_GT(viewer->newest["recording"]["bytes"], 10'000);
  ASSERT_EQ(Recordings().size(), 1u);
  EXPECT_TRUE(Recordings()[0]["seconds"].is_null()) << "it is not ended";
  viewer.reset();
  const auto ended = Record({"stop", run_->instance_id()});
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  EXPECT_THAT(ended.out, HasSubstr("no longer recorded; " + file + " has "));
  ASSERT_EQ(Recordings().size(), 1u);
  const double seconds = Recordings()[0]["seconds"];
  EXPECT_GT(seconds, 2);
  EXPECT_THAT(Record({"list"}).out, HasSubstr(file));

  const auto player = Play(file), other = Play(file);
  ASSERT_TRUE(Until({player.get(), other.get()}, "all bodies of then", [&] {
    return SeesAll(*player) && SeesAll(*other) && player->newest.contains("status") && RegionsAlive(*player) == 4;
  }));
  // By then at the latest, for the gateway says so four times a second; on a slow machine the end may be near.
  const double all_seen_s = std::min(player->newest["play"].value("at_s", 0.0), seconds - 1) + 0.5;
  other->Send({{"type", "play"}, {"paused", true}, {"at_s", 1}});
  ASSERT_TRUE(Until({other.get()}, "a pause near the begin", [&] {
    return other->decoder.paused && std::abs(other->newest["play"].value("at_s", 0.0) - 1) < 1e-3;
  }));
  EXPECT_EQ(player->decoder.own_body, 0u);
  EXPECT_NEAR(player->newest["play"]["end_s"], seconds, 1e-6);
  EXPECT_EQ(player->decoder.hosts.size(), 4u);
  player->Send({{"type", "play"}, {"paused", true}, {"at_s", seconds}});
  ASSERT_TRUE(Until({player.get()}, "the end, where the failover was", [&] {
    return player->newest["play"].value("at_s", 0.0) == seconds && player->newest["status"].value("failovers", 0) == 1;
  }));
  EXPECT_TRUE(Until({player.get()}, "all bodies, and what happened",
                    [&] { return SeesAll(*player) && player->decoder.paused && player->texts["events"] > 0; }))
      << player->decoder.bodies.size() << " bodies; paused: " << player->decoder.paused << "; "
      << player->texts["events"] << " messages of events";
  EXPECT_NEAR(other->newest["play"].value("at_s", 0.0), 1, 1e-3) << "each has its own time";
  player->Send({{"type", "play"}, {"at_s", all_seen_s}});
  ASSERT_TRUE(Until(
      {player.get()}, "back to where it saw them first",
      [&] { return std::abs(player->newest["play"].value("at_s", 0.0) - all_seen_s) < 1e-3 && SeesAll(*player); }))
      << player->decoder.bodies.size() << " bodies; " << player->newest["play"];
  player->Send({{"type", "order"}, {"number", 2}, {"order", "pause"}});
  ASSERT_TRUE(Until({player.get()}, "the answer", [&] { return player->newest.contains("answer"); }));
  EXPECT_THAT(player->newest["answer"]["text"].get<std::string>(), HasSubstr("a recording takes no orders"));

  // The same file, for the command line; and played by nobody else than who names it right.
  const auto told = Tessera({"client", "--play", Folder() + "/" + file, "--from", "1", "--speed", "4"});
  EXPECT_EQ(told.exit_code, 0) << told.err;
  const auto beyond = Tessera({"client", "--play", Folder() + "/" + file, "--from", "1e6"});
  EXPECT_EQ(beyond.exit_code, 1);
  EXPECT_THAT(beyond.err, HasSubstr("--from 1e+06"));

  // In a terminal keys stop it, set its place, and end it.
  support::PseudoTerminal terminal({support::BinaryPath("tessera"), "client", "--play", Folder() + "/" + file});
  ASSERT_TRUE(terminal.Until("space pauses", 30s)) << terminal.output();
  ASSERT_TRUE(terminal.Until("0:01.", 30s)) << terminal.output();
  terminal.Type(" ");
  ASSERT_TRUE(terminal.Until(", paused: ", 30s)) << terminal.output();
  terminal.Type("\x1b[H");
  ASSERT_TRUE(terminal.Until("0:00.00 of ", 30s)) << terminal.output();
  terminal.Type(".");
  ASSERT_TRUE(terminal.Until("0:00.01 of ", 30s)) << terminal.output();
  EXPECT_TRUE(terminal.Until("PLAYING", 30s)) << terminal.output();
  terminal.Type("q");
  EXPECT_EQ(terminal.WaitForEnd(30s), 0) << terminal.output();
}

TEST_F(RecordingTest, WhatIsNotThereOrDamagedOrTooMuchIsSaid) {
  ASSERT_NO_FATAL_FAILURE(StartWorld(1));
  const auto none = Record({"start", "inst-99"});
  EXPECT_EQ(none.exit_code, 1);
  EXPECT_THAT(none.err, HasSubstr("instance inst-99: no such instance"));
  const auto idle = Record({"stop", run_->instance_id()});
  EXPECT_THAT(idle.out, HasSubstr("was not recorded"));
  const auto nobody = Tessera({"record", "list", "--gateway", "127.0.0.1:1"});
  EXPECT_EQ(nobody.exit_code, 1);
  EXPECT_THAT(nobody.err, HasSubstr("no gateway at 127.0.0.1:1; see --gateway"));
  EXPECT_EQ(telemetry::HttpPost(address(), "/api/recordings/../x/start")->status, 404);
  EXPECT_EQ(telemetry::HttpPost(address(), "/api/worlds")->status, 404);

  std::ofstream(Folder() + "/bad.rec") << std::string(5000, 'x');
  const auto missing = Play("missing.rec"), damaged = Play("bad.rec"), outside = Play("..%2F..%2Fx.rec");
  ASSERT_TRUE(Until({missing.get(), damaged.get(), outside.get()}, "they are told", [&] {
    return missing->closed && damaged->closed && (outside->closed || outside->http_status != 0);
  }));
  EXPECT_EQ(missing->closed, "4000 no_recording");
  EXPECT_EQ(damaged->closed, "4000 damaged");
  EXPECT_THAT(damaged->newest["problem"]["text"].get<std::string>(), HasSubstr("bad.rec: is not a recording"));
  EXPECT_EQ(outside->http_status, 404);

  // A gateway without a folder, one without a key, and one with little room.
  const std::string bare_key = run_->cluster().state_dir() + "/bare-key", small_key = bare_key + "-of-small";
  FurtherGateway bare(run_->cluster().control_address(), {"--key-file", bare_key});
  const std::string small_folder = run_->cluster().state_dir() + "/small";
  FurtherGateway strict(run_->cluster().control_address(), {"--recordings-dir", small_folder});
  FurtherGateway small(run_->cluster().control_address(),
                       {"--key-file", small_key, "--recordings-dir", small_folder, "--recordings-mb", "10"});
  std::ofstream(small_folder + "/much.rec");
  fs::resize_file(small_folder + "/much.rec", 9'900'000);
  const std::string id = run_->instance_id();
  const auto refused = Tessera({"record", "start", id, "--gateway", bare.address, "--token-file", bare_key});
  const auto stranger = Tessera({"record", "start", id, "--gateway", bare.address, "--token-file", small_key});
  EXPECT_THAT(stranger.err, HasSubstr("an order needs the key of this gateway"));
  EXPECT_THAT(refused.err, HasSubstr("--recordings-dir names a folder"));
  const auto no_orders = Tessera({"record", "start", id, "--gateway", strict.address});
  EXPECT_THAT(no_orders.err, HasSubstr("without --key-file"));
  ViewerSocket viewer(small.address, id);
  ASSERT_TRUE(Until({&viewer}, "all bodies", [&] { return SeesAll(viewer); }));
  const std::string line = host::ReadFile(small_key, 1024).value_or("");
  const std::string key(absl::StripAsciiWhitespace(line));
  viewer.Send({{"type", "authorize"}, {"number", 1}, {"key", key}});
  viewer.Send({{"type", "order"}, {"number", 2}, {"order", "record"}, {"on", true}});
  ASSERT_TRUE(Until({&viewer}, "the file is full", [&] {
    return viewer.newest.contains("recording") && viewer.newest["recording"]["problem"] != "";
  }));
  EXPECT_EQ(viewer.newest["recording"]["on"], false);
  EXPECT_THAT(viewer.newest["recording"]["problem"].get<std::string>(), HasSubstr("full, at 100000 bytes"));
  const std::string file = viewer.newest["recording"]["file"];
  EXPECT_LE(fs::file_size(small_folder + "/" + file), 100'000u);
  ViewerSocket player(small.address, "", {.path = "/play/" + file});
  EXPECT_TRUE(Until({&player}, "what fits is whole", [&] { return SeesAll(player); }));
  const std::size_t frames = viewer.decoder.frames;
  EXPECT_TRUE(Until({&viewer}, "who watches sees on", [&] { return viewer.decoder.frames > frames + 30; }));
  for (FurtherGateway* gateway : {&bare, &strict, &small}) EXPECT_TRUE(gateway->End().Clean());
}

}  // namespace
}  // namespace tessera::end_to_end
