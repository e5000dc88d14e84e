#include "control_plane/grpc_faults.h"

#include <gtest/gtest.h>

namespace tessera::control {
namespace {

TEST(GrpcFaultsTest, EachIsThereUntilItsVersion) {
  EXPECT_EQ(KnownGrpcFaults("1.51.1"), "CVE-2023-1428, CVE-2023-4785, CVE-2023-33953, CVE-2023-44487");
  EXPECT_EQ(KnownGrpcFaults("1.53.0"), "CVE-2023-4785, CVE-2023-33953, CVE-2023-44487");
  EXPECT_EQ(KnownGrpcFaults("1.53.2"), "CVE-2023-44487");
  EXPECT_EQ(KnownGrpcFaults("1.60.0-pre1"), "");
  EXPECT_EQ(KnownGrpcFaults("2.0"), "");
  EXPECT_EQ(KnownGrpcFaults("unknown"), KnownGrpcFaults("1.51.1"));
}

}  // namespace
}  // namespace tessera::control
