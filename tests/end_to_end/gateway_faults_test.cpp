// Faults as viewers of a real gateway are told of them: a control plane that is away, a region without a worker, a
// world that goes back to a checkpoint, and one that has failed.
#include <gmock/gmock.h>

#include <algorithm>
#include <csignal>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <regex>
#include <string>
#include <utility>
#include <vector>

#include "gateway/testing/viewer_socket.h"
#include "telemetry/http_get.h"
#include "tests/end_to_end/gateway_fixture.h"

namespace tessera::end_to_end {
namespace {

using gateway::ViewerSocket;
using nlohmann::json;
using testing::Contains;
using testing::HasSubstr;
using testing::StartsWith;

// All texts that a viewer was sent, as far as these tests ask for them.
struct ToldTexts {
  void Take(const json& text) {
    const std::string type = text.at("type");
    if (type == "events") {
      for (const json& event : text.at("events")) events.push_back(event.at("text"));
    }
    if (type == "recording" && text.at("problem") != "") recording_problems.push_back(text.at("problem"));
    if (type == "status") {
      bool any = false;
      for (const json& region : text.at("regions")) any = any || region.at("alive").get<bool>();
      all_dead = all_dead || !any;
    }
  }

  std::vector<std::string> events, recording_problems;
  bool all_dead = false;  // a status said so of all regions
};

class GatewayFaultsTest : public GatewayTest {
 protected:
  // Without bots, who come back by the control plane.
  void StartAlone(std::uint32_t regions, std::function<void(v1::InstanceSpec&)> adjust = {}) {
    Start({.scene = "",
           .regions = regions,
           .bots = 0,
           .hosts = 2,
           .capacity = 8,
           .page_listen = "127.0.0.1:0",
           .adjust = std::move(adjust)});
    ASSERT_FALSE(address().empty());
  }
  std::unique_ptr<ViewerSocket> WatchAndNote(ToldTexts& told) {
    return Watch({.on_text = [&told](const json& text) { told.Take(text); }});
  }
  json Listed(const std::string& path) {
    const auto page = telemetry::HttpGet(address(), path);
    return page.ok() ? json::parse(page->body) : json::object();
  }
  // Gives an order by the key that the viewer has shown; returns what is said of it.
  std::string Order(ViewerSocket& viewer, json order) {
    viewer.newest.erase("answer");
    order["type"] = "order";
    order["number"] = ++last_order_;
    viewer.Send(order);
    EXPECT_TRUE(Until({&viewer}, order.dump(), [&] { return viewer.newest.contains("answer"); }));
    EXPECT_EQ(viewer.newest["answer"].value("ok", false), true) << viewer.newest["answer"];
    return viewer.newest["answer"].value("text", "");
  }
  static json NewestOf(const ViewerSocket& viewer, const std::string& type) {
    const auto found = viewer.newest.find(type);
    return found == viewer.newest.end() ? json::object() : found->second;
  }
  static bool IsAlive(const ViewerSocket& viewer, std::uint32_t region) {
    for (const json& one : NewestOf(viewer, "status").value("regions", json::array())) {
      if (one.at("region") == region) return one.at("alive").get<bool>();
    }
    return false;
  }

 private:
  std::uint64_t last_order_ = 100;
};

TEST_F(GatewayFaultsTest, TheListOfWorldsSaysThatItIsOldWhileTheControlPlaneIsAway) {
  ASSERT_NO_FATAL_FAILURE(StartAlone(1));
  const auto viewer = Watch();
  const auto lists_one = [&](bool old) {
    const json list = Listed("/api/worlds");
    return list.value("worlds", json::array()).size() == 1 && list.contains("problem") == old;
  };
  ASSERT_TRUE(Until({viewer.get()}, "all bodies, and the world in the list",
                    [&] { return SeesAll(*viewer) && lists_one(false); }));
  run_->cluster().KillControl();
  ASSERT_TRUE(Until({viewer.get()}, "the list says that it is old", [&] { return lists_one(true); }));
  EXPECT_THAT(Listed("/api/worlds").value("problem", ""),
              HasSubstr("control plane at " + run_->cluster().control_address()));
  // The world goes on, for who watches it already and for who comes now.
  const std::size_t frames = viewer->decoder.frames;
  const auto late = Watch();
  ASSERT_TRUE(Until({viewer.get(), late.get()}, "frames, and figures that grow old", [&] {
    return viewer->decoder.frames > frames + 60 && SeesAll(*late) &&
           NewestOf(*viewer, "status").value("age_s", 0.0) > 2;
  }));
  run_->cluster().RestartControl();
  run_->WatchAnew();
  ASSERT_TRUE(Until({viewer.get(), late.get()}, "the list and the figures are new",
                    [&] { return lists_one(false) && NewestOf(*viewer, "status").value("age_s", 9.0) < 2; }));
  for (const ViewerSocket* one : {viewer.get(), late.get()}) {
    EXPECT_EQ(one->decoder.welcomes, 1u);
    EXPECT_FALSE(one->closed.has_value());
  }
}

TEST(GatewayWithoutControlPlaneTest, SaysFromTheFirstAnswerOnThatItKnowsNoWorlds) {
  FurtherGateway gateway("unix:/nowhere/control.sock", {});
  const auto page = telemetry::HttpGet(gateway.address, "/api/worlds");
  ASSERT_TRUE(page.ok()) << page.status();
  const json list = json::parse(page->body);
  EXPECT_THAT(list.value("problem", ""), StartsWith("control plane at unix:/nowhere/control.sock: "));
  EXPECT_EQ(list.at("worlds").size(), 0u);
  EXPECT_TRUE(gateway.End().Clean());
}

// A failover is over before anybody can be told who is dead, so the control plane is away meanwhile.
TEST_F(GatewayFaultsTest, ARegionWithoutAWorkerIsToldDeadUntilItIsCarriedOn) {
  ASSERT_NO_FATAL_FAILURE(StartAlone(4));
  ASSERT_TRUE(PlayUntilProtected());
  ToldTexts told;
  const auto viewer = WatchAndNote(told);
  ASSERT_TRUE(Until({viewer.get()}, "all regions", [&] { return SeesAll(*viewer) && RegionsAlive(*viewer) == 4; }));
  const auto victim = static_cast<pid_t>(ReportOf(2).identity().pid());
  told = {};  // before the gateway had joined it heard no region
  run_->cluster().KillControl();
  ASSERT_EQ(kill(victim, SIGKILL), 0);
  ASSERT_TRUE(Until({viewer.get()}, "region 2 dead, and no other",
                    [&] { return !IsAlive(*viewer, 2) && RegionsAlive(*viewer) == 3; }));
  EXPECT_FALSE(told.all_dead);
  const std::uint64_t map = viewer->decoder.map_version;
  run_->cluster().RestartControl();
  run_->WatchAnew();
  const auto is_told = [&] {
    return std::ranges::any_of(told.events, [](const std::string& text) { return text.starts_with("failover of "); });
  };
  ASSERT_TRUE(Until({viewer.get()}, "a failover, and a worker for each region", [&] {
    return NewestOf(*viewer, "status").value("failovers", 0) == 1 && RegionsAlive(*viewer) == 4 && SeesAll(*viewer) &&
           is_told();
  })) << testing::PrintToString(told.events);
  EXPECT_GT(viewer->decoder.map_version, map);
  EXPECT_EQ(viewer->decoder.welcomes, 1u) << "it is the same world";
  EXPECT_EQ(NewestOf(*viewer, "status").value("lost_bodies", 1), 0);
}

TEST_F(GatewayFaultsTest, ARestoredWorldBeginsAnewForWhoWatchesAndIsLostToItsPlayers) {
  ASSERT_NO_FATAL_FAILURE(StartAlone(2));
  ASSERT_TRUE(PlayUntilProtected());
  ToldTexts told;
  const auto viewer = WatchAndNote(told), player = Watch();
  const auto both = {viewer.get(), player.get()};
  ASSERT_TRUE(Until(both, "all bodies", [&] { return SeesAll(*viewer) && SeesAll(*player); }));
  ASSERT_NO_FATAL_FAILURE(ShowKey(*viewer));
  player->Send({{"type", "join"}, {"name", "ada"}});
  ASSERT_TRUE(Until(both, "ada's body", [&] {
    return player->decoder.own_body != 0 && viewer->decoder.bodies.contains(player->decoder.own_body);
  }));
  Order(*viewer, {{"order", "record"}, {"on", true}});
  ASSERT_TRUE(Until(both, "it is recorded", [&] { return NewestOf(*viewer, "recording").value("on", false); }));
  const std::string file = viewer->newest["recording"]["file"];

  const std::string made = Order(*viewer, {{"order", "checkpoint"}});
  std::smatch tick;
  ASSERT_TRUE(std::regex_match(made, tick, std::regex("checkpoint of tick ([0-9]+)"))) << made;
  // Further on than the restored world has come when it is seen again.
  ASSERT_TRUE(Until(both, "ten seconds later", [&] { return viewer->decoder.tick > std::stoull(tick[1]) + 600; }));
  const std::uint64_t reached = viewer->decoder.tick;
  told = {};
  EXPECT_EQ(Order(*viewer, {{"order", "restore"}, {"tick", std::stoull(tick[1])}}), "goes on from tick " + tick.str(1));
  ASSERT_TRUE(Until(both, "the world of then, from a welcome on", [&] {
    return viewer->decoder.welcomes == 2 && SeesAll(*viewer) && viewer->decoder.tick < reached;
  }));
  EXPECT_TRUE(told.all_dead) << "all its workers ended";
  ASSERT_TRUE(Until(both, "its regions, what happened, and another recording", [&] {
    const json recording = NewestOf(*viewer, "recording");
    return RegionsAlive(*viewer) == 2 && !told.events.empty() && recording.value("on", false) &&
           recording.value("file", file) != file;
  }));
  EXPECT_THAT(told.events, Contains(StartsWith("restored from the checkpoint of tick " + tick.str(1) + ", ")));
  EXPECT_THAT(told.recording_problems, Contains(HasSubstr("another recording begins when it is back")));
  EXPECT_FALSE(viewer->closed.has_value());

  ASSERT_TRUE(Until(both, "the player is told", [&] { return player->closed.has_value(); }));
  EXPECT_EQ(player->closed, "4000 lost");
  EXPECT_THAT(NewestOf(*player, "problem").value("text", ""), HasSubstr("no region answers any more"));
  EXPECT_GT(NewestOf(*player, "problem").value("again_s", 0), 0);
  const auto again = Watch();
  EXPECT_TRUE(Until({viewer.get(), again.get()}, "who comes again watches", [&] { return SeesAll(*again); }));
  EXPECT_EQ(again->decoder.own_body, 0u);
}

TEST_F(GatewayFaultsTest, AWorldThatHasFailedIsToldSoWithItsReason) {
  ASSERT_NO_FATAL_FAILURE(
      StartAlone(2, [](v1::InstanceSpec& spec) { spec.mutable_checkpoint_interval()->set_seconds(0); }));
  const auto viewer = Watch();
  ASSERT_TRUE(Until({viewer.get()}, "all bodies", [&] { return SeesAll(*viewer); }));
  // All at once, so that nobody has a copy; and there is no checkpoint.
  const auto pids = Pids();
  for (const int signal : {SIGSTOP, SIGKILL}) {
    for (const auto& [region, pid] : pids) kill(static_cast<pid_t>(pid), signal);
  }
  const auto expect_told = [&](ViewerSocket& one) {
    EXPECT_TRUE(one.Until([&] { return one.closed.has_value(); }, kPatience));
    EXPECT_EQ(one.closed, "4000 failed");
    const json problem = NewestOf(one, "problem");
    // Told by the control plane's list or, where that was first, by its refusal of a new grant.
    EXPECT_THAT(problem.value("text", ""), HasSubstr(run_->instance_id() + " has failed: "));
    EXPECT_THAT(problem.value("text", ""), HasSubstr("region"));
    EXPECT_FALSE(problem.contains("again_s")) << "no time helps: " << problem;
  };
  expect_told(*viewer);
  const auto late = Watch();
  expect_told(*late);
  EXPECT_EQ(telemetry::HttpGet(address(), "/healthz")->status, 200);
}

}  // namespace
}  // namespace tessera::end_to_end
