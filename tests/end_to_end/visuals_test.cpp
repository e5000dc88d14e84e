// Meshes of an imported level on their way from one disk through the control plane to gateways on others.
#include <gmock/gmock.h>

#include <filesystem>
#include <string>

#include "core/world/sha256.h"
#include "gateway/testing/page_request.h"
#include "host/files.h"
#include "tests/end_to_end/gateway_fixture.h"

namespace tessera::end_to_end {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr std::size_t kMaxMesh = std::size_t{64} << 20;

class VisualsTest : public GatewayTest {
 protected:
  void SetUp() override {
    Start({.scene = support::ScenePath("course"), .regions = 1, .bodies = std::nullopt, .bots = 0, .capacity = 4});
    const auto imported = Tessera(
        {"scene", "import", TESSERA_SOURCE_DIR "/tests/fuzz/seeds/gltf_fuzz/harbour.glb", File("harbour.json")});
    ASSERT_EQ(imported.exit_code, 0) << imported.err;
    for (const fs::directory_entry& entry : fs::directory_iterator(File("visuals"))) mesh_ = entry.path();
    sha256_ = mesh_.stem().string();
    ASSERT_TRUE(IsSha256Hex(sha256_)) << mesh_;
  }
  std::string File(const std::string& name) const { return folder_.path() + "/" + name; }
  support::RunResult Create() {
    return Tessera({"instance", "create", "--scene", File("harbour.json"), "--regions", "1", "--wait"});
  }
  std::string PathOfMesh() const { return "/visuals/" + sha256_ + ".glb"; }
  void ExpectServes(const std::string& address) {
    const gateway::PageAnswer answer = gateway::RequestPage(address, PathOfMesh());
    EXPECT_EQ(answer.status, 200) << answer.body;
    EXPECT_EQ(Sha256Hex(answer.body), sha256_);
  }
  std::string Control() { return run_->cluster().control_address(); }

  const host::TemporaryFolder folder_;
  fs::path mesh_;
  std::string sha256_;
};

TEST_F(VisualsTest, AGatewayOnAnEmptyDiskServesTheMeshesOfAWorldThatWasMadeElsewhere) {
  FurtherGateway gateway(Control(), {"--visual-cache", File("cache")});
  const gateway::PageAnswer none = gateway::RequestPage(gateway.address, "/visuals/" + Sha256Hex("none") + ".glb");
  EXPECT_EQ(none.status, 404);
  EXPECT_THAT(none.body, HasSubstr("the control plane has no file " + Sha256Hex("none")));

  const auto created = Create();
  ASSERT_EQ(created.exit_code, 0) << created.err;
  EXPECT_THAT(created.err, HasSubstr(mesh_.string()));
  const auto again = Create();
  ASSERT_EQ(again.exit_code, 0) << again.err;
  EXPECT_EQ(again.err.find(mesh_.string()), std::string::npos) << "it is there: " << again.err;
  fs::remove_all(File("visuals"));  // which no gateway needs from now on

  ExpectServes(gateway.address);
  const std::string kept = host::ReadFile(File("cache") + "/" + sha256_ + ".glb", kMaxMesh).value_or("");
  EXPECT_EQ(Sha256Hex(kept), sha256_);

  // Without a control plane, on the same disk and on another one.
  run_->cluster().KillControl();
  FurtherGateway next(Control(), {"--visual-cache", File("cache")}), empty(Control(), {});
  ExpectServes(next.address);
  const gateway::PageAnswer lost = gateway::RequestPage(empty.address, PathOfMesh());
  EXPECT_EQ(lost.status, 503);
  EXPECT_THAT(lost.body, HasSubstr("the control plane did not send it"));
  run_->cluster().RestartControl();
  for (FurtherGateway* one : {&gateway, &next, &empty}) EXPECT_TRUE(one->End().Clean());
  FurtherGateway after(Control(), {});
  ExpectServes(after.address);
}

TEST_F(VisualsTest, AWorldWhoseMeshesAreNowhereIsNotMade) {
  fs::rename(File("visuals"), File("elsewhere"));
  const auto refused = Create();
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_THAT(refused.err, HasSubstr(sha256_ + ".glb is missing, and the control plane does not have it; --visuals"));
  const auto told = Tessera({"instance", "create", "--scene", File("harbour.json"), "--visuals", File("elsewhere"),
                             "--regions", "1", "--dry-run"});
  EXPECT_EQ(told.exit_code, 0) << told.err;
  EXPECT_THAT(told.err, HasSubstr("would be sent"));
  const auto sent = Tessera({"scene", "upload", File("harbour.json"), "--visuals", File("elsewhere")});
  EXPECT_EQ(sent.exit_code, 0) << sent.err;
  EXPECT_THAT(sent.out, HasSubstr("sent"));
  EXPECT_EQ(Create().exit_code, 0) << "the control plane has them";
}

}  // namespace
}  // namespace tessera::end_to_end
