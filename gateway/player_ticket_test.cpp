// Visitors play by tickets, and who has none, or a wrong one, watches on and is told why.
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>

#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "gateway/gateway.h"
#include "gateway/instance_feed.h"
#include "gateway/viewer_format.h"
#include "host/temporary_folder.h"
#include "tessera/v1/instance.grpc.pb.h"
#include "tessera/v1/session.grpc.pb.h"

namespace tessera::gateway {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using testing::HasSubstr;

constexpr auto kTicketPatience = 30s;

// A control plane's account of an instance that runs.
class RunningInstance final : public v1::InstanceService::Service {
 public:
  grpc::Status WatchInstance(grpc::ServerContext*, const v1::WatchInstanceRequest* request,
                             grpc::ServerWriter<v1::WatchInstanceResponse>* writer) override {
    v1::WatchInstanceResponse response;
    response.mutable_instance()->set_id(request->id());
    response.mutable_instance()->set_state(v1::INSTANCE_STATE_RUNNING);
    writer->Write(response);
    AwaitEnd();
    return grpc::Status::OK;
  }
  void AwaitEnd() {
    std::unique_lock lock(mutex_);
    ended_.wait(lock, [this] { return over_; });
  }
  void End() {
    const std::lock_guard lock(mutex_);
    over_ = true;
    ended_.notify_all();
  }

 private:
  std::mutex mutex_;
  std::condition_variable ended_;
  bool over_ = false;
};

// A door that takes no guests, and no ticket: one is of somebody who is banned.
class TicketDoor final : public v1::SessionService::Service {
 public:
  explicit TicketDoor(const std::string& address) {
    grpc::ServerBuilder builder;
    builder.AddListeningPort(address, grpc::InsecureServerCredentials());
    builder.RegisterService(this);
    builder.RegisterService(&instance_);
    server_ = builder.BuildAndStart();
  }
  ~TicketDoor() override {
    End();
    server_->Shutdown();
  }
  // Answers whoever still waits.
  void End() { instance_.End(); }

  grpc::Status JoinInstance(grpc::ServerContext*, const v1::JoinInstanceRequest* request,
                            v1::JoinInstanceResponse*) override {
    if (request->viewer()) {
      instance_.AwaitEnd();
      return {grpc::StatusCode::UNAVAILABLE, "this door ends"};
    }
    const std::lock_guard lock(mutex_);
    asked_.push_back(request->player_name() + "/" + request->ticket());
    if (request->ticket() == "banned") return {grpc::StatusCode::PERMISSION_DENIED, "ticket: ada is banned: cheats"};
    if (!request->ticket().empty()) return {grpc::StatusCode::UNAUTHENTICATED, "ticket: ran out 31 s ago"};
    return {grpc::StatusCode::UNAUTHENTICATED, "ticket: this instance takes no guests: a ticket is needed"};
  }
  std::vector<std::string> asked() {
    const std::lock_guard lock(mutex_);
    return asked_;
  }

 private:
  RunningInstance instance_;
  std::mutex mutex_;
  std::vector<std::string> asked_;
  std::unique_ptr<grpc::Server> server_;
};

class PlayerTicketTest : public testing::Test {
 protected:
  void TearDown() override {
    door_.End();  // the gateway's join to watch
    gateway_.reset();
  }
  // Whatever the options' control plane is, what is watched comes from the one here.
  void Open(GatewayOptions options) {
    gateway_.reset();
    const auto channel = DialControl(AtSocket().control);
    ASSERT_TRUE(channel.ok()) << channel.status();
    gateway_ = std::make_unique<Gateway>(std::move(options), *channel, metrics_, [this] {
      const std::lock_guard lock(mutex_);
      woken_ = true;
      wake_.notify_one();
    });
    viewer_ = gateway_->Open("inst-1");
  }
  GatewayOptions AtSocket() const {
    GatewayOptions options;
    options.control = address_;
    return options;
  }
  // The problem that the message leads to.
  json ProblemAfter(const json& message) {
    gateway_->Receive(viewer_, message.dump(), std::chrono::steady_clock::now());
    const auto until = std::chrono::steady_clock::now() + kTicketPatience;
    while (std::chrono::steady_clock::now() < until) {
      const auto now = std::chrono::steady_clock::now();
      while (const auto next = gateway_->Next(viewer_, now)) {
        if (next->binary) continue;
        const json text = json::parse(next->bytes.begin(), next->bytes.end());
        if (text.value("type", "") == "problem") return text;
      }
      {
        std::unique_lock lock(mutex_);
        wake_.wait_until(lock, until, [this] { return woken_; });
        woken_ = false;
      }
      gateway_->Tick(std::chrono::steady_clock::now());
    }
    return {};
  }

  host::TemporaryFolder folder_;
  const std::string address_ = "unix:" + folder_.path() + "/door.sock";
  TicketDoor door_{address_};
  GatewayMetrics metrics_;
  std::mutex mutex_;
  std::condition_variable wake_;
  bool woken_ = false;
  std::unique_ptr<Gateway> gateway_;
  ViewerId viewer_ = 0;
};

TEST_F(PlayerTicketTest, WhoLacksOneIsToldSoAndWhoseCountsForNothingWhy) {
  ASSERT_NO_FATAL_FAILURE(Open(AtSocket()));
  const json needed = ProblemAfter({{"type", "join"}, {"name", "ada"}});
  EXPECT_EQ(needed.value("code", ""), "ticket");
  EXPECT_EQ(needed.value("text", ""), "instance inst-1: ticket: this instance takes no guests: a ticket is needed");
  EXPECT_FALSE(gateway_->Over(viewer_)) << "it watches on";
  const json late = ProblemAfter({{"type", "join"}, {"ticket", "late"}});
  EXPECT_EQ(late.value("code", ""), "ticket");
  EXPECT_THAT(late.value("text", ""), HasSubstr("ran out 31 s ago"));
  const json banned = ProblemAfter({{"type", "join"}, {"ticket", "banned"}});
  EXPECT_EQ(banned.value("code", ""), "ticket");
  EXPECT_THAT(banned.value("text", ""), HasSubstr("cheats"));
  EXPECT_EQ(door_.asked(), (std::vector<std::string>{"ada/", "/late", "/banned"})) << "the ticket says the name";
  EXPECT_EQ(metrics_.tickets_refused.Value(), 3);
  EXPECT_EQ(metrics_.players.Value(), 0);
}

TEST_F(PlayerTicketTest, WhoTriesOneAfterAnotherIsClosedAtTheTenth) {
  ASSERT_NO_FATAL_FAILURE(Open(AtSocket()));
  for (int i = 1; i < kMaxBadMessages; ++i) {
    EXPECT_EQ(ProblemAfter({{"type", "join"}, {"ticket", "late"}}).value("code", ""), "ticket") << i;
  }
  EXPECT_EQ(ProblemAfter({{"type", "join"}, {"ticket", "late"}}).value("code", ""), "bad_message");
  EXPECT_EQ(gateway_->Over(viewer_), "bad_message");
}

TEST_F(PlayerTicketTest, AGuestWhoAsksInVainMayAskOnForThereIsNothingToGuess) {
  ASSERT_NO_FATAL_FAILURE(Open(AtSocket()));
  for (int i = 0; i <= kMaxBadMessages; ++i) {
    EXPECT_EQ(ProblemAfter({{"type", "join"}, {"name", "ada"}}).value("code", ""), "ticket") << i;
  }
}

TEST_F(PlayerTicketTest, ItIsExchangedAtThePlayersDoorWhereThatIsElsewhere) {
  const std::string elsewhere = "unix:" + folder_.path() + "/players.sock";
  TicketDoor players(elsewhere);
  GatewayOptions options = AtSocket();
  options.players_door = elsewhere;
  ASSERT_NO_FATAL_FAILURE(Open(options));
  EXPECT_THAT(ProblemAfter({{"type", "join"}, {"ticket", "late"}}).value("text", ""), HasSubstr("ran out 31 s ago"));
  EXPECT_EQ(players.asked(), (std::vector<std::string>{"/late"}));
  EXPECT_TRUE(door_.asked().empty());
}

// To the door they are all of the gateway's address, and one visitor must not use up what that may have.
TEST_F(PlayerTicketTest, AVisitorWhoJoinsAgainAndAgainAsAGuestLeavesTheDoorToOthers) {
  const std::string elsewhere = "unix:" + folder_.path() + "/players.sock";
  TicketDoor players(elsewhere);
  GatewayOptions options = AtSocket();
  options.players_door = elsewhere;
  ASSERT_NO_FATAL_FAILURE(Open(options));
  viewer_ = gateway_->Open("inst-1", "10.0.0.7");
  json refused = json::object();
  for (int i = 0; i < 100 && refused.value("code", "") != "full"; ++i) {
    refused = ProblemAfter({{"type", "join"}, {"name", "eve"}});
  }
  EXPECT_THAT(refused.value("text", ""), HasSubstr("too many guests join from your address"));
  EXPECT_EQ(refused.value("again_s", 0), kGuestAgain_s);
  EXPECT_GE(players.asked().size(), static_cast<std::size_t>(kGuestsOfAVisitor.burst));
  EXPECT_LT(players.asked().size(), 100U);
  viewer_ = gateway_->Open("inst-1", "10.0.0.8");
  EXPECT_EQ(ProblemAfter({{"type", "join"}, {"name", "ada"}}).value("code", ""), "ticket") << "the door was asked";
  EXPECT_EQ(players.asked().back(), "ada/");
}

TEST_F(PlayerTicketTest, NoneIsTakenInTheClearOrWhereTheDoorIsNotKnown) {
  GatewayOptions clear = AtSocket();
  clear.takes_tokens = false;
  ASSERT_NO_FATAL_FAILURE(Open(clear));
  EXPECT_THAT(ProblemAfter({{"type", "join"}, {"ticket", "good"}}).value("text", ""), HasSubstr("in the clear"));
  door_.End();
  GatewayOptions unknown;
  unknown.control = "127.0.0.1:1#" + std::string(64, 'a');
  unknown.control.credentials.bearer_token = "tsa_own";
  ASSERT_NO_FATAL_FAILURE(Open(unknown));
  EXPECT_THAT(ProblemAfter({{"type", "join"}, {"ticket", "good"}}).value("text", ""), HasSubstr("--players-door"));
  EXPECT_TRUE(door_.asked().empty()) << "it has not left the gateway";
}

}  // namespace
}  // namespace tessera::gateway
