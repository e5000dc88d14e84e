// A client reads without protobuf as protobuf wrote it. Here, because core/replication does not link protobuf.
#include "core/replication/region_message.h"

#include <google/protobuf/stubs/logging.h>
#include <gtest/gtest.h>

#include <random>

#include "core/world/byte_view.h"
#include "core/world/partition_io.h"
#include "tessera/v1/game.pb.h"

namespace tessera::client {
namespace {

using replication::DecodeRegionMessage;

template <class T>
T Read(const v1::RegionControl& message) {
  const auto read = DecodeRegionMessage(AsBytes(message.SerializeAsString()));
  EXPECT_TRUE(read.ok()) << read.status();
  if (!read.ok() || !std::holds_alternative<T>(*read)) {
    ADD_FAILURE() << "another kind";
    return {};
  }
  return std::get<T>(*read);
}

PartitionMap LargeMap() {
  return MakeGridMap({-100.5, -50.25, 100, 250}, 300)->With({.paused = true, .ticks_per_second = 12.5, .game = 70000});
}

void AddEndpoint(v1::RegionEndpoint& endpoint) {
  endpoint.set_region(4'000'000'000);
  endpoint.set_host("play.example");
  endpoint.set_game_port(65535);
  endpoint.set_incarnation(~0ull);
}

TEST(RegionMessageTest, NewsOfTheWorldAreReadAsTheyWereWritten) {
  v1::RegionControl message;
  v1::WorldNews& news = *message.mutable_world_news();
  news.set_epoch(~0u);
  news.set_tick(1ull << 40);
  news.set_properties(std::string("\0\1\377", 3));
  const auto read = Read<replication::NewsOfWorld>(message);
  EXPECT_EQ(read.epoch, ~0u);
  EXPECT_EQ(read.tick, 1ull << 40);
  EXPECT_EQ(read.properties, (std::vector<std::uint8_t>{0, 1, 255}));
}

TEST(RegionMessageTest, AWelcomeIsReadAsItWasWritten) {
  v1::RegionControl message;
  v1::RegionWelcome& welcome = *message.mutable_welcome();
  welcome.set_region(3);
  welcome.set_incarnation(99);
  welcome.set_player(1u << 31);
  welcome.set_tick(1ull << 40);
  welcome.set_started(true);
  *welcome.mutable_map() = ToProto(LargeMap());
  AddEndpoint(*welcome.add_endpoints());
  AddEndpoint(*welcome.add_endpoints());
  welcome.mutable_clock()->set_paused(true);
  welcome.mutable_clock()->set_ticks_per_second(0.1);
  welcome.mutable_clock()->set_tick(7);
  const auto read = Read<replication::Welcome>(message);
  EXPECT_EQ(read.region, 3u);
  EXPECT_EQ(read.player, 1u << 31);
  EXPECT_TRUE(read.started);
  const auto map = read.news.map.Make();
  ASSERT_TRUE(map.ok()) << map.status();
  EXPECT_EQ(*map, LargeMap());
  ASSERT_EQ(read.news.endpoints.size(), 2u);
  EXPECT_EQ(read.news.endpoints[1].region, 4'000'000'000);
  EXPECT_EQ(read.news.endpoints[1].host, "play.example");
  EXPECT_EQ(read.news.endpoints[1].game_port, 65535u);
  EXPECT_EQ(read.news.endpoints[1].incarnation, ~0ull);
  ASSERT_TRUE(read.clock.has_value());
  EXPECT_TRUE(read.clock->paused);
  EXPECT_EQ(read.clock->ticks_per_second, 0.1);
  EXPECT_EQ(read.clock->tick, 7u);
  message.mutable_welcome()->clear_clock();
  EXPECT_FALSE(Read<replication::Welcome>(message).clock.has_value());
}

TEST(RegionMessageTest, EveryRefusalHasItsReasonAndItsName) {
  for (int reason = 0; reason <= 100; ++reason) {
    if (!v1::RefusalReason_IsValid(reason)) continue;
    v1::RegionControl message;
    message.mutable_refusal()->set_reason(static_cast<v1::RefusalReason>(reason));
    message.mutable_refusal()->set_detail("why \xc3\xa4");
    const auto read = Read<replication::RegionRefusal>(message);
    EXPECT_EQ(static_cast<int>(read.reason), reason);
    EXPECT_EQ(read.detail, "why \xc3\xa4");
    EXPECT_EQ("REFUSAL_REASON_" + NameOf(read.reason), v1::RefusalReason_Name(static_cast<v1::RefusalReason>(reason)));
  }
}

TEST(RegionMessageTest, PairsAreReadAsTheyWereWritten) {
  v1::RegionControl message;
  message.mutable_pair_events()->set_tick(~0ull);
  message.mutable_pair_events()->set_whole(true);
  v1::PairEvent& met = *message.mutable_pair_events()->add_events();
  met.set_body_a(1);
  met.set_body_b(1ull << 33);
  met.set_begin(true);
  met.mutable_contact()->mutable_point()->set_x(-0.1);
  met.mutable_contact()->mutable_normal()->set_z(1);
  met.mutable_contact()->set_impulse(1e300);
  v1::PairEvent& left = *message.mutable_pair_events()->add_events();
  left.set_trigger(true);
  const auto read = Read<replication::PairNews>(message);
  EXPECT_EQ(read.tick, ~0ull);
  EXPECT_TRUE(read.whole);
  ASSERT_EQ(read.events.size(), 2u);
  EXPECT_EQ(read.events[0].body_b, 1ull << 33);
  EXPECT_TRUE(read.events[0].begin && !read.events[0].trigger && read.events[0].contact.has_value());
  EXPECT_EQ(read.events[0].contact->point, Vec3d(-0.1, 0, 0));
  EXPECT_EQ(read.events[0].contact->normal, Vec3d(0, 0, 1));
  EXPECT_EQ(read.events[0].contact->impulse, 1e300);
  EXPECT_TRUE(read.events[1].trigger && !read.events[1].begin && !read.events[1].contact.has_value());
}

TEST(RegionMessageTest, NewsOfAPlayerIsReadAsItWasWritten) {
  v1::RegionControl message;
  v1::PlayerNews& news = *message.mutable_player_news();
  news.set_last_command(5);
  news.set_last_event(9);
  news.set_epoch(77);
  news.set_spectating(true);
  news.set_view_x(1), news.set_view_y(2), news.set_view_z(-3);
  v1::GameEvent& event = *news.add_events();
  event.set_name("score");
  event.set_values(std::string("\0\xff\1", 3));
  news.set_controlled_body(std::uint64_t{1} << 40);
  news.mutable_limits()->set_force_n(0);
  news.mutable_limits()->set_speed_m_s(2.5);
  news.mutable_limits()->set_axis_x(1);
  news.set_joints(std::string("\1\0\2", 3));
  const auto read = Read<replication::NewsOfPlayer>(message);
  EXPECT_EQ(read.controlled_body, std::uint64_t{1} << 40);
  EXPECT_EQ(read.limits, (PlayerLimits{.force_n = 0.F, .torque_nm = {}, .speed_m_s = 2.5F, .axes = {1, 0, 0}}));
  EXPECT_EQ(read.joints, (std::vector<std::uint8_t>{1, 0, 2}));
  EXPECT_EQ(read.last_command, 5u);
  EXPECT_EQ(read.last_event, 9u);
  EXPECT_EQ(read.epoch, 77u);
  EXPECT_TRUE(read.spectating);
  EXPECT_EQ(read.view, Vec3d(1, 2, -3));
  ASSERT_EQ(read.events.size(), 1u);
  EXPECT_EQ(read.events[0].name, "score");
  EXPECT_EQ(read.events[0].values, (std::vector<std::uint8_t>{0, 255, 1}));
}

TEST(RegionMessageTest, TheSmallOnesAreReadAsTheyWereWritten) {
  v1::RegionControl message;
  message.mutable_started()->set_tick(8);
  EXPECT_EQ(Read<replication::Started>(message).tick, 8u);
  message.mutable_stopping()->set_reason("maintenance");
  EXPECT_EQ(Read<replication::Stopping>(message).reason, "maintenance");
  EXPECT_FALSE(Read<replication::Stopping>(message).goes_on);
  message.mutable_stopping()->set_goes_on(true);
  EXPECT_TRUE(Read<replication::Stopping>(message).goes_on);
  message.mutable_session_ended()->set_reason("cheating");
  EXPECT_EQ(Read<replication::EndOfSession>(message).reason, "cheating");
  message.mutable_input_refused()->set_body(3);
  message.mutable_input_refused()->set_input_number(4);
  message.mutable_input_refused()->set_detail("not yours");
  const auto input = Read<replication::InputRefusal>(message);
  EXPECT_EQ(input.body, 3u);
  EXPECT_EQ(input.input_number, 4u);
  EXPECT_EQ(input.detail, "not yours");
  message.mutable_command_refused()->set_number(6);
  message.mutable_command_refused()->set_for_good(true);
  const auto command = Read<replication::CommandRefusal>(message);
  EXPECT_EQ(command.number, 6u);
  EXPECT_TRUE(command.for_good);
  message.mutable_clock()->set_ticks_per_second(30);
  EXPECT_EQ(Read<replication::ClockNews>(message).ticks_per_second, 30);
  *message.mutable_map()->mutable_map() = ToProto(LargeMap());
  EXPECT_EQ(*Read<replication::MapNews>(message).map.Make(), LargeMap());
  message.mutable_map()->mutable_map()->mutable_cells(0)->set_owner(9999);
  EXPECT_FALSE(Read<replication::MapNews>(message).map.Make().ok());
}

TEST(RegionMessageTest, WhatProtobufRefusesIsRefusedAndNothingElse) {
  v1::RegionControl welcome;
  *welcome.mutable_welcome()->mutable_map() = ToProto(*MakeGridMap({0, 0, 8, 8}, 4));
  welcome.mutable_welcome()->set_player(7);
  AddEndpoint(*welcome.mutable_welcome()->add_endpoints());
  const std::string genuine = welcome.SerializeAsString();
  const google::protobuf::LogSilencer quiet;  // it complains of each text that is not UTF-8
  std::mt19937 random(3);
  int refused = 0;
  for (int i = 0; i < 20'000; ++i) {
    std::string changed = genuine.substr(0, 1 + random() % genuine.size());
    changed[random() % changed.size()] = static_cast<char>(random());
    v1::RegionControl by_protobuf;
    const bool parsed = by_protobuf.ParseFromString(changed);
    const auto read = DecodeRegionMessage(AsBytes(changed));
    // Groups, which no message of ours has, are refused here alone.
    EXPECT_TRUE(parsed || !read.ok()) << i;
    refused += read.ok() ? 0 : 1;
  }
  EXPECT_GT(refused, 1000);
  EXPECT_LT(refused, 20'000);
  EXPECT_FALSE(DecodeRegionMessage({}).ok());
}

}  // namespace
}  // namespace tessera::client
