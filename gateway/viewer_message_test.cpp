// Every field of a viewer's message is checked, and there is a limit to all that a viewer sends.
#include "gateway/viewer_message.h"

#include <gmock/gmock.h>

#include <string>
#include <vector>

#include "gateway/viewer_format.h"

namespace tessera::gateway {
namespace {

using namespace std::chrono_literals;

template <class Message>
Message Read(std::string_view text) {
  const auto message = ParseViewerMessage(text);
  EXPECT_TRUE(message.ok()) << message.status();
  const Message* read = message.ok() ? std::get_if<Message>(&*message) : nullptr;
  EXPECT_NE(read, nullptr) << text;
  return read == nullptr ? Message() : *read;
}

std::string WhyNot(std::string_view text) { return std::string(ParseViewerMessage(text).status().message()); }

TEST(ViewerMessageTest, AViewLeavesOutWhatStays) {
  const auto all = Read<SetView>(R"({"type":"view","rate_hz":60,"center":[1,2,3],"radius_m":50,"kbytes_per_s":200})");
  EXPECT_EQ(all.rate_hz, 60u);
  EXPECT_EQ(all.center, (Vec3d{1, 2, 3}));
  EXPECT_EQ(all.radius_m, 50);
  EXPECT_EQ(all.bytes_per_s, 200'000);
  const auto none = Read<SetView>(R"({"type":"view"})");
  EXPECT_FALSE(none.rate_hz.has_value());
  EXPECT_FALSE(none.center.has_value());
  EXPECT_EQ(none.radius_m, 0);
  EXPECT_FALSE(none.bytes_per_s.has_value());
}

TEST(ViewerMessageTest, ReadsWhatAPlayerAndAnOperatorSend) {
  EXPECT_EQ(Read<Select>(R"({"type":"select","body":"18446744073709551615"})").body, BodyId(~std::uint64_t{0}));
  EXPECT_EQ(Read<Select>(R"({"type":"select"})").body, BodyId());
  EXPECT_EQ(Read<JoinWorld>(R"({"type":"join","name":"ада"})").name, "ада");
  EXPECT_EQ(Read<JoinWorld>(R"({"type":"join","name":"ада"})").ticket, "");
  EXPECT_EQ(Read<JoinWorld>(R"({"type":"join","ticket":"AVZH"})").ticket, "AVZH");
  Read<LeaveWorld>(R"({"type":"leave"})");
  const auto steer = Read<Steer>(
      R"({"type":"steer","force":[1,2,3],"torque":[0,0,1],"move":[0,1],"yaw":1.5,"pitch":-0.5,"buttons":5})");
  EXPECT_EQ(steer.steering.force_n, (Vec3f{1, 2, 3}));
  EXPECT_EQ(steer.steering.move.y, 1);
  EXPECT_EQ(steer.steering.buttons, 5u);
  const auto order =
      Read<Order>(R"({"type":"order","number":3,"order":"set_property","body":"7","name":"health","value":80})");
  EXPECT_EQ(order.kind, OrderKind::kSetProperty);
  EXPECT_EQ(order.number, 3u);
  EXPECT_EQ(order.body, BodyId(7));
  EXPECT_EQ(order.value, 80);
  EXPECT_EQ(NameOf(order.kind), "set_property");
  EXPECT_TRUE(Read<Order>(R"({"type":"order","number":4,"order":"record","on":true})").on);
  const auto step = Read<Order>(R"({"type":"order","number":4,"order":"step","ticks":10})");
  EXPECT_EQ(step.kind, OrderKind::kStep);
  EXPECT_EQ(step.ticks, 10u);
  EXPECT_EQ(Read<ShowProperty>(R"({"type":"property","name":"health"})").name, "health");
  EXPECT_EQ(Read<ShowProperty>(R"({"type":"property"})").name, "");
  const auto authorize = Read<Authorize>(R"({"type":"authorize","number":5,"token":"tsa_1"})");
  EXPECT_EQ(authorize.number, 5u);
  EXPECT_EQ(authorize.token, "tsa_1");
  EXPECT_EQ(Read<Authorize>(R"({"type":"authorize","number":5,"key":"ab"})").key, "ab");
  const auto play = Read<PlayControl>(R"({"type":"play","paused":true,"speed":2,"step":-3})");
  EXPECT_EQ(play.paused, true);
  EXPECT_EQ(play.speed, 2);
  EXPECT_EQ(play.step, -3);
  EXPECT_FALSE(play.at_s.has_value());
}

TEST(ViewerMessageTest, WhatIsWrongIsNamed) {
  EXPECT_EQ(WhyNot(""), "message: must be an object of JSON");
  EXPECT_EQ(WhyNot("[1,2]"), "message: must be an object of JSON");
  EXPECT_EQ(WhyNot("{\"type\":\"view\""), "message: must be an object of JSON");
  EXPECT_EQ(WhyNot("\xff\xfe"), "message: must be an object of JSON");
  EXPECT_EQ(WhyNot(std::string(4000, '[')), "message: must be an object of JSON");
  EXPECT_EQ(WhyNot(R"({"type":"order","number":1,"order":"step"})"), "ticks: is missing");
  EXPECT_EQ(WhyNot(R"({"type":"order","number":1,"order":"step","ticks":0})"),
            "ticks: must be a whole number from 1 to 36000");
  EXPECT_EQ(WhyNot(R"({"type":"dance"})"),
            "type: must be view, select, join, leave, steer, order, play, authorize or property");
  EXPECT_EQ(WhyNot(R"({"type":"view","kbytes_per_s":15})"), "kbytes_per_s: must be a whole number from 16 to 1000000");
  EXPECT_EQ(WhyNot(R"({"type":7})"), "type: must be a text of at most 64 bytes");
  EXPECT_EQ(WhyNot(R"({"type":"view","rate_hz":0})"), "rate_hz: must be a whole number from 1 to 60");
  EXPECT_EQ(WhyNot(R"({"type":"view","rate_hz":30.5})"), "rate_hz: must be a whole number from 1 to 60");
  EXPECT_EQ(WhyNot(R"({"type":"view","radius_m":-1})"), "radius_m: must be a number from 0 to 1e+07");
  EXPECT_EQ(WhyNot(R"({"type":"view","center":[1,2]})"), "center: must be 3 numbers from -1e+07 to 1e+07");
  EXPECT_EQ(WhyNot(R"({"type":"view","center":[1,2,"x"]})"), "center: must be 3 numbers from -1e+07 to 1e+07");
  EXPECT_EQ(WhyNot(R"({"type":"select","body":7})"), "body: must be the id of a body, as a text");
  EXPECT_EQ(WhyNot(R"({"type":"select","body":"-7"})"), "body: must be the id of a body, as a text");
  EXPECT_EQ(WhyNot(R"({"type":"steer","yaw":1e9})"), "yaw: must be a number from -10000 to 10000");
  EXPECT_EQ(WhyNot(R"({"type":"steer","yaw":1e999})"), "message: must be an object of JSON");
  EXPECT_EQ(WhyNot(R"({"type":"order","order":"pause"})"), "number: is missing");
  EXPECT_EQ(WhyNot(R"({"type":"order","number":1,"order":"explode"})"), "order: is none that a gateway knows");
  EXPECT_EQ(WhyNot(R"({"type":"order","number":1,"order":"scale"})"), "regions: is missing");
  EXPECT_EQ(WhyNot(R"({"type":"order","number":1,"order":"scale","regions":5000})"),
            "regions: must be a whole number from 1 to 1000");
  EXPECT_EQ(WhyNot(R"({"type":"authorize","token":"tsa_1"})"), "number: is missing");
  EXPECT_EQ(WhyNot(R"({"type":"authorize","number":1})"), "token: give it, or a key");
  EXPECT_EQ(WhyNot(R"({"type":"authorize","number":1,"token":"a","key":"b"})"), "token: give it, or a key");
  EXPECT_EQ(WhyNot(R"({"type":"authorize","number":1,"token":")" + std::string(257, 'x') + "\"}"),
            "token: must be a text of at most 256 bytes");
  EXPECT_EQ(WhyNot(R"({"type":"play","speed":0})"), "speed: must be a number from 0.1 to 16");
  EXPECT_EQ(WhyNot(R"({"type":"play","at_s":-1})"), "at_s: must be a number from 0 to 1e+09");
  EXPECT_EQ(WhyNot(R"({"type":"play","step":1.5})"), "step: must be a whole number");
  EXPECT_EQ(WhyNot(R"({"type":"play","paused":1})"), "paused: must be true or false");
  EXPECT_EQ(WhyNot(R"({"type":"join","name":"ada","ticket":"AVZH"})"),
            "name: the ticket says the name; leave it empty");
  EXPECT_EQ(WhyNot(R"({"type":"join","ticket":")" + std::string(1737, 'x') + "\"}"),
            "ticket: must be a text of at most 1736 bytes");
  EXPECT_THAT(WhyNot(R"({"type":"join","name":"a\nb"})"), testing::HasSubstr("control character"));
}

// A field of a message, and values of it in JSON. `rest`: what the message has beside it.
struct FieldCase {
  std::string rest, name;
  std::vector<std::string> wrong, right;
};

std::string JsonText(std::size_t bytes) { return '"' + std::string(bytes, 'x') + '"'; }

std::vector<FieldCase> FieldCases() {
  const std::string order = R"("type":"order","number":1,"order":"checkpoint")", token = R"("type":"authorize")";
  const std::vector<std::string> no_body = {
      "7",        "true",     "[\"7\"]",  "{}",         R"("")",
      R"("-7")",  R"("+7")",  R"(" 7")",  R"("7 ")",    R"("7x")",
      R"("0x7")", R"("1e3")", R"("7.0")", R"("seven")", R"("18446744073709551616")"};
  const std::vector<std::string> bodies = {R"("0")", R"("7")", R"("18446744073709551615")", "null"};
  const std::vector<std::string> no_number = {"-1", "1.5", R"("1")", "true", "9007199254740993"};
  return {
      {R"("x":1)", "type", {"7", R"("dance")", "null", JsonText(65)}, {R"("leave")"}},
      {R"("type":"view")", "rate_hz", {"0", "61", "-1", "30.5", R"("30")", "true"}, {"1", "60", "null"}},
      {R"("type":"view")", "center", {"7", "[1,2]", "[1,2,3,4]", R"([1,2,"3"])", "[1,2,1e8]"}, {"[1,-2.5,1e7]"}},
      {R"("type":"view")", "radius_m", {"-1", "1e8", R"("9")"}, {"0", "1e7"}},
      {R"("type":"view")", "kbytes_per_s", {"15", "1000001", "20.5"}, {"16", "1000000"}},
      {R"("type":"select")", "body", no_body, bodies},
      {R"("type":"property")", "name", {"7", "true", "[]", "{}", JsonText(64)}, {JsonText(63), R"("")", "null"}},
      {R"("type":"join")", "name", {"7", R"("a\nb")", JsonText(33)}, {JsonText(32), R"("")"}},
      {R"("type":"join")", "ticket", {"7", JsonText(1737)}, {JsonText(1736)}},
      {R"("type":"steer")", "force", {"1", "[1,2]", "[1,2,1e16]"}, {"[1,2,-1e15]"}},
      {R"("type":"steer")", "torque", {"1", "[1,2,3,4]", "[0,-1e300,0]"}, {"[1,2,3]"}},
      {R"("type":"steer")", "move", {"1", "[1]", "[1,2,3]", "[1e300,0]"}, {"[1,2]"}},
      {R"("type":"steer")", "yaw", {"10001", R"("0")"}, {"-10000"}},
      {R"("type":"steer")", "pitch", {"-10001", "[]"}, {"10000"}},
      {R"("type":"steer")", "buttons", {"-1", "1.5", "4294967296"}, {"4294967295"}},
      {R"("type":"order","order":"checkpoint")", "number", no_number, {"9007199254740992"}},
      {R"("type":"order","number":1)", "order", {"7", R"("explode")", "null"}, {R"("resume")"}},
      {order, "regions", {"0", "1001", R"("2")"}, {"1", "1000"}},
      {order, "region", {"0", "4294967296"}, {"1", "4294967295"}},
      {order, "ticks", {"0", "36001"}, {"1", "36000"}},
      {order, "tick", no_number, {"0"}},
      {order, "ticks_per_second", {"0.5", "1e6", R"("60")"}, {"1", "59.5"}},
      {order, "host", {"7", JsonText(65)}, {JsonText(64)}},
      {order, "name", {"7", JsonText(64)}, {JsonText(63)}},
      {order, "body", no_body, bodies},
      {order, "on", {"1", R"("true")"}, {"true"}},
      {R"("type":"play")", "paused", {"1"}, {"false"}},
      {R"("type":"play")", "speed", {"0.05", "17", R"("1")"}, {"0.1", "16"}},
      {R"("type":"play")", "at_s", {"-1", "1e10"}, {"0", "1e9"}},
      {R"("type":"play")", "step", {"1.5", "1001", "-1001", "true"}, {"-1000"}},
      {token + R"(,"token":"a")", "number", no_number, {"0"}},
      {token + R"(,"number":1)", "token", {"7", R"("")", JsonText(257)}, {JsonText(256)}},
      {token + R"(,"number":1)", "key", {"7", JsonText(65)}, {JsonText(64)}},
  };
}

TEST(ViewerMessageTest, EachFieldIsCheckedAndNamed) {
  for (const FieldCase& field : FieldCases()) {
    const auto message = [&](const std::string& value) {
      return "{" + field.rest + ",\"" + field.name + "\":" + value + "}";
    };
    for (const std::string& value : field.wrong) {
      EXPECT_THAT(WhyNot(message(value)), testing::StartsWith(field.name + ": ")) << message(value);
    }
    for (const std::string& value : field.right) EXPECT_EQ(WhyNot(message(value)), "") << message(value);
  }
}

TEST(MessageBudgetTest, ASecondsWorthMayComeAtOnceAndNoMore) {
  MessageBudget budget;
  MessageBudget::TimePoint now{1h};
  int taken = 0;
  for (int i = 0; i < 1000; ++i) taken += budget.Take(now) ? 1 : 0;
  EXPECT_EQ(taken, 120);
  taken = 0;
  for (int i = 0; i < 10'000; ++i) taken += budget.Take(now += 1ms) ? 1 : 0;
  EXPECT_NEAR(taken, 1200, 2) << "ten seconds of a thousand a second";
}

TEST(MessageBudgetTest, TheTenthBadMessageWithinAMinuteIsTheLast) {
  MessageBudget budget;
  MessageBudget::TimePoint now{1h};
  for (int i = 0; i < 100; ++i) EXPECT_FALSE(budget.Strike(now += 7s)) << "nine in a minute at most";
  int borne = 0;
  while (!budget.Strike(now += 1s)) ++borne;
  EXPECT_LE(borne, 9);
}

}  // namespace
}  // namespace tessera::gateway
