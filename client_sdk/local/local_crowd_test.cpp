// A player among the plaza's two thousand bodies, whose program polls late: the own body is shown where the region
// moves it by the player's inputs.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "client_sdk/client.h"
#include "client_sdk/local/local_world.h"
#include "core/region/region.h"
#include "core/world/math.h"

namespace tessera::local {
namespace {

constexpr int kHz = 60, kTicksAPoll = 15;

std::string Plaza() {
  std::ifstream file(TESSERA_SOURCE_DIR "/scenes/plaza.textproto");
  std::ostringstream text;
  text << file.rdbuf();
  return std::move(text).str();
}

TEST(LocalCrowdTest, AProgramThatPollsLateShowsItsOwnBodyWhereItIs) {
  auto world = LocalWorld::Open({.scene = Plaza(), .scene_name = "plaza", .snapshot_rate_hz = 30});
  ASSERT_TRUE(world.ok()) << world.status();
  const auto grant = (*world)->Grant();
  ASSERT_TRUE(grant.ok()) << grant.status();
  client::GrantOptions options;
  options.bind_address = "127.0.0.1";
  options.predict = true;
  auto joined = client::Client::JoinByGrant(*grant, options);
  ASSERT_TRUE(joined.ok()) << joined.status();
  client::Client& client = **joined;

  std::chrono::steady_clock::time_point now{std::chrono::hours(1)};
  int frames = 0, predicted = 0;
  double off_m = 0, way_m = 0;
  Vec3d before;
  for (int at = 1; at <= 7 * kHz; ++at) {
    now += std::chrono::nanoseconds(1'000'000'000 / kHz);
    ASSERT_TRUE((*world)->Advance(now).ok());
    // It joins at a usual pace, and then has four frames a second.
    if (at > kHz && at % kTicksAPoll != 0) continue;
    client.Move({300, 0, 0}, {});
    (void)client.Poll(now);
    const std::vector<client::ShownBody> shown = client.Interpolated(now);
    if (at < 3 * kHz) continue;  // it falls, and looks for its ground
    const auto own = std::ranges::find(shown, client.own_body(), &client::ShownBody::id);
    ASSERT_NE(own, shown.end());
    ++frames;
    predicted += own->predicted ? 1 : 0;
    off_m = std::max(off_m, Length(own->pose.position - (*world)->region().world().StateOf(own->id).position));
    if (frames > 1) way_m += Length(own->pose.position - before);
    before = own->pose.position;
  }
  EXPECT_GT(client.World().size(), 2000u);
  EXPECT_EQ(predicted, frames);
  EXPECT_GT(way_m, 5);
  EXPECT_LT(off_m, 0.2 * 12) << "a fifth of a second of its largest speed";
}

}  // namespace
}  // namespace tessera::local
