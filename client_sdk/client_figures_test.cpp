#include "client_sdk/client_figures.h"

#include <gtest/gtest.h>

namespace tessera::client {
namespace {

using std::chrono::milliseconds;

TEST(ClientFiguresTest, RatesAreThoseOfTheLastSecond) {
  ClientFigures figures;
  ClientFigures::TimePoint now{std::chrono::hours(1)};
  for (int i = 0; i < 30; ++i, now += milliseconds(100)) {
    if (i < 15) figures.Received(1000);  // 10 000 a second, and then no more
    figures.Sent(50);
    figures.MeasureRates(now);
    ClientStats stats;
    figures.AddTo(stats);
    if (i == 0) continue;
    EXPECT_NEAR(stats.bytes_out_per_s, 500, 1e-6) << i;
    if (i < 15) {
      EXPECT_NEAR(stats.bytes_in_per_s, 10'000, 1e-6) << i;
    } else if (i >= 25) {
      EXPECT_EQ(stats.bytes_in_per_s, 0) << i;
    }
  }
}

TEST(ClientFiguresTest, SamplesThatAreCloseTogetherCountAsOne) {
  ClientFigures figures;
  const ClientFigures::TimePoint now{std::chrono::hours(1)};
  figures.MeasureRates(now);
  figures.Received(100);
  figures.MeasureRates(now);  // the same moment: a rate over no time would be none
  ClientStats stats;
  figures.AddTo(stats);
  EXPECT_EQ(stats.bytes_in, 100u);
  EXPECT_EQ(stats.bytes_in_per_s, 0);
}

TEST(ClientFiguresTest, WorkCountsByPollAndTheDearestIsKept) {
  ClientFigures figures;
  figures.BeginPoll({});
  figures.Work(10);
  figures.Work(20);
  figures.BeginPoll(milliseconds(16));
  figures.Work(5);
  ClientStats stats;
  figures.AddTo(stats);
  EXPECT_EQ(stats.work_units, 5);
  EXPECT_EQ(stats.most_work_units, 30);
  EXPECT_EQ(stats.frame_time.count, 1u);  // between two polls
}

TEST(ClientFiguresTest, DroppedConnectionsStayInTheSums) {
  ClientFigures figures;
  RegionStats connection;
  connection.datagrams_lost = 3;
  connection.decode_errors = 1;
  connection.reconnects = 2;
  figures.Dropped(connection);
  figures.Dropped(connection);
  ClientStats stats;
  stats.datagrams_lost = 5;  // the connections that are there have lost them
  figures.AddTo(stats);
  EXPECT_EQ(stats.datagrams_lost, 11u);
  EXPECT_EQ(stats.decode_errors, 2u);
  EXPECT_EQ(stats.reconnects, 4u);
}

}  // namespace
}  // namespace tessera::client
