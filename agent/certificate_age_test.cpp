#include "agent/certificate_age.h"

#include <gtest/gtest.h>

namespace tessera::agent {
namespace {

constexpr double kIssued_s = 1e9, kLife_s = 90 * 86400.0;
constexpr CertificateAge kAge{.issued_s = kIssued_s, .life_s = kLife_s};

TEST(CertificateAgeTest, IsDueOnceTwoThirdsOfItsLifeAreOver) {
  EXPECT_FALSE(kAge.IsDue(kIssued_s));
  EXPECT_FALSE(kAge.IsDue(kIssued_s + 60 * 86400 - 1));
  EXPECT_TRUE(kAge.IsDue(kIssued_s + 60 * 86400));
  EXPECT_TRUE(kAge.IsDue(kIssued_s + 400 * 86400.0)) << "the clock was set, or the host was off";
}

TEST(CertificateAgeTest, TellsHowMuchIsLeftAndHowMuchTooLateItIs) {
  EXPECT_DOUBLE_EQ(kAge.Left(kIssued_s), kLife_s);
  EXPECT_DOUBLE_EQ(kAge.Left(kIssued_s + 80 * 86400), 10 * 86400);
  EXPECT_DOUBLE_EQ(kAge.Left(kIssued_s + 91 * 86400), -86400);
}

TEST(CertificateAgeTest, OfAClockThatWasSetBackItIsDueAndHasItsWholeLife) {
  EXPECT_TRUE(kAge.IsDue(kIssued_s - 1));
  EXPECT_DOUBLE_EQ(kAge.Left(kIssued_s - 400 * 86400.0), kLife_s);
}

TEST(CertificateAgeTest, OneOfAnUnknownTimeIsDue) {
  EXPECT_TRUE((CertificateAge{.issued_s = 0, .life_s = kLife_s}.IsDue(kIssued_s)));
}

}  // namespace
}  // namespace tessera::agent
