#include "control_plane/control_flags.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <chrono>
#include <string>
#include <vector>

namespace tessera::control {
namespace {

using ::testing::StartsWith;

// The flags of a command line; its error, where the options are refused as they are parsed, is the exception's.
ControlFlags Parsed(std::vector<std::string> options) {
  ControlFlags flags;
  CLI::App app("", "tessera-control");
  AddControlOptions(app, flags);
  options.insert(options.begin(), {"--state-dir", "/state"});
  std::reverse(options.begin(), options.end());  // as CLI11 takes them
  app.parse(options);
  return flags;
}

TEST(ControlFlagsTest, WhatIsNotNamedLiesInTheStateFolder) {
  ControlFlags flags = Parsed({});
  ASSERT_TRUE(CheckControlFlags(flags).ok());
  const ReignSettings settings = SettingsOf(flags);
  EXPECT_EQ(settings.doors.socket, "/state/control.sock");
  EXPECT_EQ(settings.seal, "/state/seal.key");
  EXPECT_EQ(settings.checkpoints, "/state/checkpoints");
  EXPECT_EQ(settings.store_name, "/state/control.db");
  EXPECT_FALSE(settings.s3.has_value());
}

TEST(ControlFlagsTest, SecondsAndMegabytesBecomeSpansAndBytes) {
  ControlFlags flags = Parsed({"--lost-after", "2.5", "--checkpoint-reserve-mb", "3", "--checkpoint-quota-mb", "4",
                               "--visual-quota-mb", "5", "--socket", "/run/../run/tessera.sock"});
  ASSERT_TRUE(CheckControlFlags(flags).ok());
  const ReignSettings settings = SettingsOf(flags);
  EXPECT_EQ(settings.control.lost_after, std::chrono::milliseconds(2500));
  EXPECT_EQ(settings.checkpoint_reserve, 3'000'000u);
  EXPECT_EQ(settings.control.checkpoint_quota, 4'000'000u);
  EXPECT_EQ(settings.control.visual_quota, 5'000'000u);
  EXPECT_EQ(settings.doors.socket, "/run/tessera.sock");
}

TEST(ControlFlagsTest, RefusesWhatIsOutOfRangeOrNoAddress) {
  EXPECT_THROW(Parsed({"--lost-after", "0.9"}), CLI::ValidationError);
  EXPECT_THROW(Parsed({"--failover-after", "4000"}), CLI::ValidationError);
  EXPECT_THROW(Parsed({"--listen", "nowhere"}), CLI::ValidationError);
  EXPECT_THROW(Parsed({"--players-key", "key.pem"}), CLI::RequiresError);
}

TEST(ControlFlagsTest, SaysWhichOptionsDoNotGoTogether) {
  ControlFlags endpoint = Parsed({"--s3-endpoint", "https://s3.example"});
  EXPECT_THAT(std::string(CheckControlFlags(endpoint).message()), StartsWith("--s3-endpoint and --s3-region: only"));
  ControlFlags authority = Parsed({"--store-authority", "ca.pem"});
  EXPECT_THAT(std::string(CheckControlFlags(authority).message()), StartsWith("--store-authority: only with --store"));
}

}  // namespace
}  // namespace tessera::control
